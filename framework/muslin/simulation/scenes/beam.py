"""A bar held at one end bends under its own weight: against beam theory, and against its own refinement."""

from muslin.simulation.scenes.solid import SolidScene

SCENE = SolidScene(
    name="beam",
    title="A bar held at one end",
    mesh="bar",
    resolution=4,
    length=1.0,
    thickness=0.2,
    pinned="left:0",
    E=2e5,
    nu=0.3,
    rho=1000.0,
    dt=1 / 60,
    steps=180,
    frame_every=1,
    view=(0.35, 0.25, 1.0),
    still=0.25,
)
