"""S1, S2: how good are the barycentric coordinates of a sliver?

Four vertices near the corners of a square: edges of good length, and a height that shrinks. Points are put where their
coordinates are known, by `interpolate`, and `phi` is to find them again.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
rng = np.random.default_rng(1)
heights = 10.0 ** -np.arange(11)
errors, steepest = [], []
for height in heights:  # h_i, of each vertex over the face opposite it
    z = height / np.sqrt(4 - 2 * height**2)
    flat = np.array([[0, 0, 0], [1, 0, z], [1, 1, 0], [0, 1, z]])
    turns = np.linalg.qr(rng.normal(size=(200, 3, 3)))[0]
    corners = {f"X{i}": turns @ corner for i, corner in enumerate(flat)}
    phi = rng.dirichlet([1, 1, 1, 1], size=200)
    X = muslin.evaluate(f.interpolate, phi=phi, **{name.lower(): at for name, at in corners.items()})
    found = muslin.evaluate(f.phi, X=X, **corners)
    errors.append(np.median(np.linalg.norm(found - phi, axis=1)))
    steepest.append(np.median(np.linalg.norm(muslin.evaluate(f.dphi_dX, **corners), axis=2).max(axis=1)))

print("height      median error of phi    steepest gradient [1/m]")
for row in zip(heights, errors, steepest):
    print("{:<10.0e}  {:<21.1e}  {:.2g}".format(*row))
thin = (heights < 0.03) & (heights > 1e-9)
slope = np.polyfit(np.log10(heights[thin]), np.log10(np.array(errors)[thin]), 1)[0]
print(f"The error grows like the height to the power {slope:.1f}.")
curves = {"your phi": (heights, errors), "rounding / height": (heights, 1e-16 / heights)}
picture = line_plot(curves, "Barycentric coordinates of a sliver", "height", "error", log_x=True, log_y=True)
print("Drawn in", write_png("runs/experiments/slivers.png", picture))
