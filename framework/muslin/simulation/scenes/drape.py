"""A square metre of cloth falls five centimetres onto a sphere and drapes itself over it."""

from muslin.simulation.scenes.scene import Scene, lying

SCENE = Scene(
    name="drape",
    title="A cloth draped over a sphere",
    resolution=64,
    diagonals="zigzag",
    bending="quadratic",
    mu=2e3,
    lam=2e3,
    rho=0.2,
    sphere=True,
    sphere_center=(0.0, 0.0, 0.0),
    sphere_radius=0.3,
    start_at=(0.003, 0.35, 0.005),  # slightly off centre: without friction it slides off in the end
    ground=-0.62,
    floor=True,
    view=(0.55, 0.42, 1.0),
    still=0.65,
    start=lying,
)
