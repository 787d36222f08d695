"""S7: how fast does Newton's method arrive, and what if the Hessian is an old one?

A bar is held at one end and wound up at the other; where it comes to rest is a minimum of its energy. Your
`newtons_method` looks for it three times: with the Hessian of each step, with its eigenvalues projected, and with the
Hessian of the first step kept. The elasticity is yours, too.
"""

import numpy as np
from scipy.sparse.linalg import spsolve

import muslin
from muslin.mesh import block
from muslin.render import line_plot, write_png

f = muslin.load(".")
bar = block(13, 4, 4, width=1.0, height=0.2, depth=0.2)
solid = muslin.Solid(bar, C=2e4, D=5e4, functions=f)
X = bar.vertices
ends = np.isclose(abs(X[:, 0]), 0.5)
free = np.repeat(~ends, 3)
angle = 0.8 * (X[:, 0] + 0.5) ** 2  # where the search begins: not wound evenly
c, s = np.cos(angle), np.sin(angle)
start = np.stack([X[:, 0], c * X[:, 1] - s * X[:, 2], s * X[:, 1] + c * X[:, 2]], 1).ravel()


def whole(q):
    """All vertices, from those that are free."""
    place = start.copy()
    place[free] = q
    return place


def search(hessian):
    """How long the gradient was at each step [N]."""
    seen = []

    def gradient(q):
        g = solid.gradient(whole(q)).ravel()[free]
        seen.append(np.linalg.norm(g))
        return g

    f.newtons_method(
        start[free], lambda q: solid.energy(whole(q)), gradient, hessian,
        lambda H, b: spsolve(H.tocsc(), b), tolerance=1e-6, most_steps=40,
    )  # fmt: skip
    return np.array(seen)


def hessian(q, project=False):
    """Of the energy, by the free vertices."""
    return solid.hessian(whole(q), project=project)[free][:, free]


first = hessian(start[free], project=True)
ways = {
    "Hessian of each step": search(hessian),
    "projected": search(lambda q: hessian(q, project=True)),
    "Hessian of the first step": search(lambda q: first),
}
for name, seen in ways.items():
    shown = "  ".join(f"{size:.0e}" for size in seen[:10])
    print(f"{name}: {len(seen) - 1} steps, gradient [N]: {shown}{' ...' if len(seen) > 10 else ''}")
steps = np.diff(np.log(ways["Hessian of each step"]))
print(f"With the Hessian of each step the order at the end is {steps[-1] / steps[-2]:.1f}.")
left = ways["projected"][1:] / ways["projected"][:-1]
print(f"Projected, each step leaves {np.median(left):.2f} of the gradient.")  # the last may be rounding
curves = {name: (np.arange(len(seen)), seen) for name, seen in ways.items()}
picture = line_plot(
    curves, "Newton's method on a wound bar", "step", "gradient", y_unit="N", log_y=True, markers=True
)
print("Drawn in", write_png("runs/experiments/descent.png", picture))
