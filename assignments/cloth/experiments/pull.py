"""S7: pull a strip, and measure what a textbook calls its material.

The strip is stretched by s_0; its edges are free, so it gets narrower until nothing pulls across it. The force along
it gives Young's modulus, how narrow it got Poisson's ratio.
"""

import numpy as np
from scipy.optimize import brentq

import muslin

f = muslin.load(".")


def pulled(s0, mu, lam):
    """Stress along a strip stretched by s0, and its stretch across [Pa, 1]."""

    def stress(s1):
        s = np.array([s0, s1, 1.0])
        dpsi_ds = muslin.evaluate(f.dpsi_ds, s=s, mu=mu, lam=lam)
        return muslin.evaluate(f.dpsi_dF, U=np.eye(3), dpsi_ds=dpsi_ds, V=np.eye(3))[0]

    s1 = brentq(lambda s1: stress(s1)[1, 1], 0.2, 1.5, xtol=1e-15, rtol=1e-14)
    return stress(s1)[0, 0], s1


print("mu      lam        E measured    E of a sheet    nu measured   nu of a sheet")
for mu, lam in ((1000, 1000), (1000, 3000), (1000, 0), (400, 1500)):
    (low, wide), (high, narrow) = pulled(0.999, mu, lam), pulled(1.001, mu, lam)
    E, nu = (high - low) / 0.002, (wide - narrow) / 0.002
    print(
        f"{mu:<7} {lam:<7} {E:13.3f} {4 * mu * (mu + lam) / (2 * mu + lam):15.3f}"
        f" {nu:14.5f} {lam / (2 * mu + lam):15.5f}"
    )
