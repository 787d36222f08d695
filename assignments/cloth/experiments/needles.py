"""S1, S2: how good are the barycentric coordinates of a needle?

Triangles with edges of length 1 and a height that shrinks, turned at random. A point is put where its coordinates
are known, by `interpolate`, and `phi` is to find them again.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
rng = np.random.default_rng(1)
heights = 10.0 ** -np.arange(9)
errors = []
for height in heights:
    flat = np.array([[0, 0, 0], [1, 0, 0], [0.3, height, 0]])
    turns = np.linalg.qr(rng.normal(size=(200, 3, 3)))[0]
    X0, X1, X2 = (turns @ corner for corner in flat)
    phi = rng.dirichlet([1, 1, 1], size=200)
    X = muslin.evaluate(f.interpolate, phi=phi, x0=X0, x1=X1, x2=X2)
    found = muslin.evaluate(f.phi, X=X, X0=X0, X1=X1, X2=X2)
    errors.append(np.median(np.linalg.norm(found - phi, axis=1)))

print("height      median error of phi")
for height, error in zip(heights, errors):
    print(f"{height:<10.0e}  {error:.1e}")
thin = (heights < 0.03) & (heights > 1e-7)
slope = np.polyfit(np.log10(heights[thin]), np.log10(np.array(errors)[thin]), 1)[0]
print(f"The error grows like the height to the power {slope:.1f}.")
curves = {"your phi": (heights, errors), "rounding / height": (heights, 1e-16 / heights)}
picture = line_plot(curves, "Barycentric coordinates of a needle", "height", "error", log_x=True, log_y=True)
print("Drawn in", write_png("runs/experiments/needles.png", picture))
