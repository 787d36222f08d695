"""A solid held at its lowest part starts stretched: the course's own run, for meshes of the course's own size.

The course's bunny: muslin simulate wobble --mesh coarser_bunny.mesh
"""

from muslin.simulation.scenes.solid import SolidScene

SCENE = SolidScene(
    name="wobble",
    title="The course's run: held below, stretched by a fifth, let go",
    mesh="creature",
    size=150.0,
    pinned="lowest:3",
    E=6e6,
    nu=0.4,
    rho=0.1,
    gravity=(0.0, 0.0, 0.0),
    stretch=(1.0, 1.2, 1.0),
    dt=0.01,
    steps=20,
    frame_every=1,
    fps=25,
    tolerance=1e-10,
    still=0.0,
)
