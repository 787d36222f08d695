"""The course's cloth: a square pinned along its highest row under the starter's strange, published gravity."""

from muslin.simulation.scenes.scene import Scene

SCENE = Scene(
    name="course",
    title="A pinned square, as in the course",
    mesh="course-square",
    pinned="highest-row",
    E=1e5,
    nu=0.4,
    plane="strain",
    gravity=(0.0, -1800.8, 0.0),
    dt=1e-3,
    steps=300,
    frame_every=5,
    fps=30,
    view=(-1.0, 0.25, 0.75),
    sphere=True,
    sphere_center=(0.0, 0.0, 0.4),
    sphere_radius=0.22,  # never touched: the cloth stays in its plane
)
