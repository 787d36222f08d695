"""What `newtons_method` is given to minimise: sums of terms that are least at m, in coordinates y = A (x - m).

Given: no need to change it. `kind` says what the terms are.

0  quadratic: one step of Newton's is all it takes
1  flat far away: there Newton's step is far too long
2  infinite from y = -1 on, as a solid is that is pressed to nothing
3  so flat that Newton's whole step leads to the other side, as high up: it lowers the objective, but hardly
"""

import numpy as np

SHARP = 2e-5


def term(kind, y):
    """The terms, their first and their second derivatives."""
    if kind == 0:
        return y * y / 2, y, np.ones_like(y)
    if kind == 1:
        r = np.sqrt(1 + y * y)
        return y * y / (1 + r), y / r, 1 / r**3
    if kind == 2:
        return np.where(y > -1, y - np.log1p(y), np.inf), y / (1 + y), 1 / (1 + y) ** 2
    r = y * y + SHARP
    lifted = SHARP**0.75 * np.expm1(0.75 * np.log1p(y * y / SHARP))
    return lifted, 1.5 * y / r**0.25, (0.75 * y * y + 1.5 * SHARP) / r**1.25


def solve(H, b):
    """The solution of H d = b; not a number where H cannot be inverted."""
    try:
        return np.linalg.solve(H, b)
    except np.linalg.LinAlgError:
        return np.full_like(b, np.nan)


def newtons_method(A, m, w, kind, **_):
    """Functions by name, from the arrays of a case."""

    def terms(x, order):
        with np.errstate(all="ignore"):
            return w * term(kind, A @ (x - m))[order]

    return {
        "objective": lambda x: float(np.sum(terms(x, 0))),
        "gradient": lambda x: A.T @ terms(x, 1),
        "hessian": lambda x: A.T @ (terms(x, 2)[:, None] * A),
        "solve": solve,
    }
