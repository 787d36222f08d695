"""A square metre of cloth falls five centimetres onto a sphere and drapes itself over it."""

from muslin.simulation.scenes.scene import Scene, lying

SCENE = Scene(
    name="drape",
    title="A cloth draped over a sphere",
    resolution=64,
    diagonals="zigzag",
    bending="quadratic",
    mu=5e6,  # a woven cotton: E = 13 MPa and nu = 1/3 in plane stress, 0.4 mm, 0.2 kg/m^2
    lam=5e6,
    rho=500.0,
    h=4e-4,
    sphere=True,
    sphere_center=(0.0, 0.0, 0.0),
    sphere_radius=0.3,
    start_at=(0.003, 0.35, 0.005),  # slightly off centre: without friction it slides off in the end
    contact="solve",
    friction=0.3,
    ground=-0.62,
    floor=True,
    view=(0.55, 0.42, 1.0),
    still=0.65,
    start=lying,
)
