"""S5, S6: two energies that agree where little is stretched.

Your `psi` along a stretch in one direction, beside that of St. Venant and Kirchhoff, which measures strain by
E = (C - I)/2 and so needs no principal stretches; C is your `right_cauchy_green`.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
mu, lam = 1000.0, 1500.0


def both(stretch):
    s = np.stack([stretch, np.ones_like(stretch), np.ones_like(stretch)], axis=1)
    F = s[:, :, None] * np.eye(3)
    E = (muslin.evaluate(f.right_cauchy_green, F=F) - np.eye(3)) / 2
    trace = np.trace(E, axis1=1, axis2=2)
    return muslin.evaluate(f.psi, s=s, mu=mu, lam=lam), mu * (E * E).sum((1, 2)) + lam / 2 * trace**2


strain = 10.0 ** -np.arange(1, 5)
yours, theirs = both(1 + strain)
print("strain     yours        St. Venant-Kirchhoff   apart, of yours")
for e, a, b in zip(strain, yours, theirs):
    print(f"{e:<8.0e}   {a:<10.4g}   {b:<10.4g}             {abs(b - a) / a:.1e}")
power = np.polyfit(np.log(strain), np.log(abs(theirs - yours)), 1)[0]
print(f"They are apart by a power {power:.2f} of the strain.")
stretch = np.linspace(0.01, 2, 200)
yours, theirs = both(stretch)
curves = {"yours": (stretch, yours), "St. Venant-Kirchhoff": (stretch, theirs)}
picture = line_plot(curves, "The energy of a stretch", "stretch", "energy per volume", y_unit="Pa")
print("Drawn in", write_png("runs/experiments/energies.png", picture))
