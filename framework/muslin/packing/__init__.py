"""Packs: what an instructor uploads so that a platform grades with Muslin.

- `wheel`       Muslin itself, as students and graders install it
"""
