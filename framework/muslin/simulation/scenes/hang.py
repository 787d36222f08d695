"""A square metre of cloth, held by two corners, swings down like a curtain that was let go."""

from muslin.simulation.scenes.scene import Scene, lying

SCENE = Scene(
    name="hang",
    title="A cloth hanging from two corners",
    resolution=64,
    diagonals="zigzag",
    bending="quadratic",
    contact="solve",
    friction=0.3,
    pinned="corners",
    mu=5e6,  # a woven cotton: E = 13 MPa and nu = 1/3 in plane stress, 0.4 mm, 0.2 kg/m^2
    lam=5e6,
    rho=500.0,
    h=4e-4,
    dt=1 / 60,
    steps=180,
    frame_every=1,
    view=(-0.5, 0.25, 1.0),
    tilt=40.0,
    still=0.5,
    start=lying,
)
