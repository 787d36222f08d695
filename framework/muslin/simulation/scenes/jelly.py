"""A bear of jelly stands on its feet, is pulled by its head, and let go."""

from muslin.simulation.scenes.solid import FRONT, SolidScene

SCENE = SolidScene(
    name="jelly",
    title="A bear of jelly, pulled by its head and let go",
    mesh="creature",
    size=1.075,
    pinned="lowest:0.05",
    E=4e5,
    nu=0.42,
    rho=1000.0,
    dt=1 / 120,
    steps=420,
    frame_every=2,
    drag_point="0,0.95,0.02",
    drag_to=(0.7, 0.75, 0.3),
    drag_stiffness=3e3,
    drag_until=0.8,
    ground=-0.02,
    view=FRONT,
    still=0.8,
)
