"""A square metre of felt falls five centimetres onto a sphere and drapes itself over it."""

import numpy as np

from muslin.mesh import Mesh
from muslin.simulation.scenes.scene import Scene, lying


def sagging(scene: Scene, mesh: Mesh) -> np.ndarray:
    """Start lying above the sphere, the corners `scene.sag` below the middle, (n, 3) [m].

    The middles of the sides are a quarter of that above it.

    A sheet that falls level onto a sphere may fold in many ways, and which comes about is left to its triangles. No
    sheet is level; this one sags as x^4 - 6 x^2 z^2 + z^4, so that it folds in the same way on every mesh. Without a
    sphere it lies as it is.
    """
    level = lying(scene, mesh)
    if not scene.sphere or not scene.sag:
        return level
    x, _, z = (level - np.asarray(scene.start_at)).T / (np.ptp(mesh.vertices, axis=0).max() / 2)
    level[:, 1] += scene.sag / 4 * (x**4 - 6 * x**2 * z**2 + z**4)
    return level


sagging.reads = ("start_at", "tilt", "sag")  # type: ignore[attr-defined]

SCENE = Scene(
    name="drape",
    title="A cloth draped over a sphere",
    resolution=64,
    diagonals="zigzag",
    bending="quadratic",
    mu=3e5,  # a soft felt, the same in all directions: E = 0.8 MPa, nu = 1/3 in plane stress, 1.5 mm, 0.2 kg/m^2
    lam=3e5,
    rho=400 / 3,
    h=1.5e-3,
    bending_stiffness=1.1e-4,
    damping=0.01,
    sphere=True,
    sphere_center=(0.0, 0.0, 0.0),
    sphere_radius=0.3,
    start_at=(0.003, 0.35, 0.005),  # slightly off centre: without friction it slides off in the end
    sag=0.04,
    contact="solve",
    friction=0.3,
    ground=-0.62,
    floor=True,
    view=(0.55, 0.42, 1.0),
    still=0.65,
    start=sagging,
)
