"""Packs: what an instructor uploads so that a platform grades with Muslin, and what students are given.

- `packs`       `pack` writes a pack for a platform, from `templates` and the wheel
- `wheel`       Muslin itself, as students and graders install it
- `grading`     what runs on the platform: `python -I -m muslin.packing.grading PLATFORM`

A pack holds the wheel, the versions everything is pinned to, and a few lines that install them and call
`grading`. The students' has a workspace in its stead, and nothing of what is true. Hidden data are only in packs for
platforms where no student can read them.
"""
