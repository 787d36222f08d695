"""S6: a bar bends too little, and the less its volume may change the less.

A bar is held at one end and bends under its own weight, by so little that theory knows how far: rho g A L^4 / (8 E I).
The stiffness is your `d2psi_dF2` and `stiffness_block`, for several Poisson's ratios and meshes.
"""

import numpy as np
from scipy.sparse.linalg import spsolve

import muslin
from muslin.mesh import block
from muslin.render import line_plot, write_png

f = muslin.load(".")
E, rho, g = 1e8, 1000.0, 9.81
length, side = 1.0, 0.2
theory = rho * g * side**2 * length**4 / (8 * E * side**4 / 12)
ratios = (0.0, 0.3, 0.45, 0.49, 0.499)
meshes = (2, 4, 6)


def sag(nu, k):
    """How far the free end sinks, a bar k cubes thick [m]."""
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    bar = block(5 * k + 1, k + 1, k + 1, width=length, height=side, depth=side)
    solid = muslin.Solid(bar, C=mu / 2, D=lam / 2 + mu / 3, rho=rho, functions=f)
    X = bar.vertices
    K, free = solid.hessian(X.ravel()), np.repeat(X[:, 0] > X[:, 0].min() + 1e-9, 3)
    weight = -solid.mass @ np.tile([0, g, 0], len(X))
    u = np.zeros(3 * len(X))
    u[free] = spsolve(K[free][:, free].tocsc(), weight[free])
    return -u.reshape(-1, 3)[np.isclose(X[:, 0], X[:, 0].max()), 1].mean()


found = {k: np.array([sag(nu, k) for nu in ratios]) / theory for k in meshes}
print("nu       " + "  ".join(f"{k:>3} cubes thick" for k in meshes) + "   (sag, of what theory says)")
for row, nu in enumerate(ratios):
    print(f"{nu:<7}  " + "  ".join(f"{found[k][row]:15.3f}" for k in meshes))
curves = {f"{k} cubes thick": (1 - 2 * np.array(ratios), share) for k, share in found.items()}
picture = line_plot(
    curves, "A bar under its own weight", "1 - 2 nu", "sag, of theory's", log_x=True, markers=True
)
print("Drawn in", write_png("runs/experiments/locking.png", picture))
