"""S4: the tone of a bar, with its mass in the tetrahedra and with its mass at the vertices.

A bar that does not get thinner when it is pulled (nu = 0) swings along its axis and nothing else. Its lowest tone is
known: half the speed of sound over its length. Stiffness is Muslin's, the mass is summed from your `mass_block`.
"""

import numpy as np
from scipy.linalg import eigh

import muslin
from muslin.mesh import block
from muslin.render import line_plot, write_png

f = muslin.load(".")
E, rho, length = 1e5, 1000.0, 1.0
exact = np.sqrt(E / rho) / (2 * length)

edges, off = [], {"your mass_block": [], "mass at the vertices": []}
for n in (2, 4, 8, 16):
    bar = block(n + 1, 2, 2, width=length, height=0.1, depth=0.1)
    solid = muslin.Solid(bar, C=E / 4, D=E / 6, rho=rho)  # mu = E/2 and lam = 0
    K = solid.hessian(bar.vertices.ravel()).toarray()[::3, ::3]  # along the bar only
    i, j = np.divmod(np.arange(16), 4)
    M = np.zeros_like(K)
    for cell, volume in zip(bar.cells, bar.volumes):
        block_ij = muslin.evaluate(f.mass_block, i=i, j=j, volume=np.full(16, volume), rho=rho)
        np.add.at(M, (cell[i], cell[j]), block_ij)
    together = np.zeros((len(K), n + 1))
    for k in range(n + 1):  # all vertices of one section move alike
        together[np.isclose(bar.vertices[:, 0], (k / n - 0.5) * length), k] = 1
    for name, mass in zip(off, (M, np.diag(M.sum(axis=1)))):
        squares = eigh(together.T @ K @ together, together.T @ mass @ together, eigvals_only=True)
        off[name].append(np.sqrt(squares[1]) / (2 * np.pi) / exact - 1)  # squares[0]: the bar as a whole
    edges.append(length / n)

print("edge [m]    " + "    ".join(f"{name:>22}" for name in off))
for k, edge in enumerate(edges):
    print(f"{edge:<10.4f}  " + "    ".join(f"{100 * error[k]:+20.3f} %" for error in off.values()))
both = np.array(list(off.values()))
print(f"The mean of both is off by {100 * abs(both.mean(axis=0))[-1]:.1e} %.")
curves = {name: (edges, 100 * np.array(error)) for name, error in off.items()}
curves["mean of both"] = (edges, 100 * both.mean(axis=0))
picture = line_plot(curves, "The tone of a bar", "edge", "too high by %", "m", log_x=True, markers=True)
print("Drawn in", write_png("runs/experiments/tone.png", picture))
