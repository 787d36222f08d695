"""A solid held at its lowest part starts stretched by a fifth, and wobbles: the course's run, in sane numbers.

The course's mesh is 150 high, its E is 6e6, its rho 0.1 and its dt 0.01. Read in SI units that is a tower of 150 m as
light as a tenth of air, with energies of 1e11 J; a wave crosses it in two steps, and backward Euler takes all motion
within three. The course's bunny, a hundred times smaller: muslin simulate wobble --mesh coarser_bunny.mesh --scale 0.01
Its own numbers: --set size=150 --set pinned=lowest:3 --set E=6e6 --set rho=0.1 --set dt=0.01
"""

from muslin.simulation.scenes.solid import FRONT, SolidScene

SCENE = SolidScene(
    name="wobble",
    title="Held below, stretched by a fifth, let go",
    mesh="creature",
    size=1.5,
    pinned="lowest:0.03",
    E=2e5,
    nu=0.4,
    rho=1000.0,
    gravity=(0.0, 0.0, 0.0),
    stretch=(1.0, 1.2, 1.0),
    dt=1 / 240,
    steps=480,
    frame_every=4,
    ground=-0.02,
    view=FRONT,
    tolerance=1e-10,
    still=0.0,
)
