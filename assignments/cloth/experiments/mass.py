"""S4: a spinning sheet with its mass in the triangles, and with its mass at the vertices.

A square of 1 m and 1 kg is cut into ever more triangles and spun about its middle at 1 rad/s. Its kinetic energy is
known. It is summed from your `kinetic_energy`, and from a third of each triangle's mass at each corner.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
exact = 0.5 * 1 / 6  # T = I omega^2 / 2, and a square has I = m L^2 / 6
sizes, yours, at_vertices = 2 ** np.arange(6), [], []
for k in sizes:
    corner = np.stack(np.meshgrid(np.arange(k), np.arange(k)), -1).reshape(-1, 1, 2)
    lower, upper = np.array([[0, 0], [1, 0], [1, 1]]), np.array([[0, 0], [1, 1], [0, 1]])
    squares = np.concatenate([corner + lower, corner + upper])
    place = squares / k - 0.5
    v = np.stack([-place[..., 1], place[..., 0], 0 * place[..., 0]], -1)  # omega x r
    area = np.full(len(v), 0.5 / k**2)
    T = muslin.evaluate(f.kinetic_energy, v0=v[:, 0], v1=v[:, 1], v2=v[:, 2], area=area, rho=1.0, h=1.0)
    yours.append(abs(T.sum() / exact - 1))
    at_vertices.append(abs((0.5 * area[:, None] / 3 * (v**2).sum(-1)).sum() / exact - 1))

print("squares a side    yours is off by    mass at the vertices")
for k, mine, theirs in zip(sizes, yours, at_vertices):
    print(f"{k:14}    {mine:15.1e}    {theirs:20.1e}")
slope = np.polyfit(np.log(sizes), np.log(at_vertices), 1)[0]
print(f"With the mass at the vertices the error goes with the edge to the power {-slope:.2f}.")
curves = {"mass at the vertices": (1 / sizes, at_vertices), "edge squared": (1 / sizes, 1 / sizes**2)}
picture = line_plot(curves, "A spinning sheet", "edge", "error of T", log_x=True, log_y=True, markers=True)
print("Drawn in", write_png("runs/experiments/mass.png", picture))
