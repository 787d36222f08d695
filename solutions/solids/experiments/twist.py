"""S3: how well do tetrahedra follow a deformation that is not linear?

A bar is wound up by a quarter turn, its vertices exactly where the twist takes them. In the middle of each tetrahedron
your `interpolate` and `deformation_gradient` are held against the twist itself, with ever more tetrahedra.
"""

import numpy as np

import muslin
from muslin.mesh import block
from muslin.render import line_plot, write_png

f = muslin.load(".")
per_metre = np.pi / 2


def wound(X):
    """Where a twist about the x-axis takes points, and its deformation gradient there."""
    angle = per_metre * X[..., 0]
    c, s, zero, one = np.cos(angle), np.sin(angle), 0 * angle, 0 * angle + 1
    place = np.stack([X[..., 0], c * X[..., 1] - s * X[..., 2], s * X[..., 1] + c * X[..., 2]], -1)
    along = per_metre * np.stack([one / per_metre, -place[..., 2], place[..., 1]], -1)
    return place, np.stack([along, np.stack([zero, c, s], -1), np.stack([zero, -s, c], -1)], -1)


edges, off = [], {"place": [], "F": []}
for k in (1, 2, 4, 8):
    bar = block(4 * k + 1, k + 1, k + 1, width=1.0, height=0.25, depth=0.25)
    X = bar.vertices[bar.cells]
    x, _ = wound(X)
    undeformed, world = ({f"{a}{i}": at[:, i] for i in range(4)} for a, at in (("X", X), ("x", x)))
    place, F = wound(X.mean(axis=1))
    middle = muslin.evaluate(f.interpolate, phi=np.full((len(X), 4), 0.25), **world)
    dphi_dX = muslin.evaluate(f.dphi_dX, **undeformed)
    yours = muslin.evaluate(f.deformation_gradient, dphi_dX=dphi_dX, **world)
    edges.append(0.25 / k)
    off["place"].append(np.linalg.norm(middle - place, axis=1).max())
    off["F"].append(np.linalg.norm(yours - F, axis=(1, 2)).max())

print("edge [m]    off in place [m]    order    off in F    order")
for k, edge in enumerate(edges):
    orders = [f"{np.log2(e[k - 1] / e[k]):.2f}" if k else "" for e in off.values()]
    print(f"{edge:<10.4f}  {off['place'][k]:<18.1e}  {orders[0]:6}   {off['F'][k]:<9.1e}   {orders[1]}")
curves = {f"off in {name}": (edges, error) for name, error in off.items()}
picture = line_plot(curves, "A bar is wound up", "edge", "error", "m", log_x=True, log_y=True, markers=True)
print("Drawn in", write_png("runs/experiments/twist.png", picture))
