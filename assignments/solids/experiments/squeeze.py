"""S5: a solid is squeezed, from all sides and between two plates, to nothing.

Your `dpsi_dF` says how it pushes back. From all sides there is also Hooke's law, which is what it is for small strains,
and the pressure of the other usual energy of a change of volume, D (log J)^2.
"""

import numpy as np
from scipy.optimize import brentq

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
E, nu = 1e5, 0.45
mu, bulk = E / (2 * (1 + nu)), E / (3 * (1 - 2 * nu))
C, D = mu / 2, bulk / 2


def stress(along, across):
    """Stress along and across a box that is stretched by these [Pa]."""
    F = np.diag([along, across, across])
    P = muslin.evaluate(f.dpsi_dF, F=F, C=C, D=D)[0]
    return P[0, 0], P[1, 1]


def between_plates(s):
    """Stretch across, free of stress, of a box that is pressed to the part s of its height; stress along it."""
    across = brentq(lambda t: stress(s, t)[1], 1e-3, 20 / np.sqrt(s), xtol=1e-14)
    return across, stress(s, across)[0]


(wide, high), (narrow, low) = between_plates(1.001), between_plates(0.999)
print(
    f"small strains: E = {(high - low) / 0.002:.1f} Pa of {E:.1f}, nu = {(narrow - wide) / 0.002:.5f} of {nu}"
)
sides = np.linspace(0.02, 1.2, 119)
pressure = -np.array([stress(s, s)[0] / s**2 for s in sides])  # force over the area that is left
shown = sides >= 0.2
plates = -np.array([between_plates(s)[1] for s in sides[shown]])
print("both in bulk moduli, as in the picture:")
print("side     pressure, from all sides    force between plates, per first area")
for s in (1.2, 1.0, 0.8, 0.6, 0.4, 0.3, 0.2):
    here, there = np.argmin(abs(sides - s)), np.argmin(abs(sides[shown] - s))
    row = np.round([pressure[here] / bulk, plates[there] / bulk], 3) + 0.0  # no -0
    print(f"{s:<7.2f}  {row[0]:22.3f}    {row[1]:35.3f}")
print(
    f"Squeezed to nothing from all sides it pushes back with {pressure[0] / bulk:.4f} times its bulk modulus."
)
logarithm = -bulk * 3 * np.log(sides) / sides**3
curves = {
    "your P, from all sides": (sides, pressure / bulk),
    "Hooke's law": (sides, 3 * (1 - sides)),
    "D (log J)^2": (sides, np.where(logarithm < 4 * bulk, logarithm, np.nan) / bulk),
    "your P, between plates": (sides[shown], np.where(plates < 4 * bulk, plates, np.nan) / bulk),
}
picture = line_plot(curves, "A solid is squeezed", "side, of what it was", "pressure, of the bulk modulus")
print("Drawn in", write_png("runs/experiments/squeeze.png", picture))
