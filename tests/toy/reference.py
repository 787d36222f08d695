"""What students must not read of the toy's tasks: how cases are drawn, what is true, what mistakes make of it.

What they may read is in `practice/`.
"""

import numpy as np

from muslin.judging import Law, Mistake
from muslin.judging.exact import (
    add,
    apply,
    cross,
    derivative,
    dot,
    gradient,
    hessian,
    norm,
    sub,
    times,
    transpose,
)
from muslin.tasks.comparing import size_of

# energy ------------------------------------------------------------------------------------------------------------


def energy(entries, mu):
    return mu / 2 * (dot(entries, entries) - 3)


def draw_psi(draw, k):
    """Anything, and rest."""
    at_rest = [[1.0 * (i == j) for j in range(3)] for i in range(3)]
    return {"F": at_rest if k % 5 == 4 else draw.matrix(2), "mu": draw.decades(0, 4)}


draw_dpsi_dF = draw_d2psi_dF2 = draw_psi


def truth_psi(F, mu):
    return energy([entry for row in F for entry in row], mu)


def truth_dpsi_dF(F, mu):
    P = gradient(lambda x: energy(x, mu), [entry for row in F for entry in row])
    return [P[:3], P[3:6], P[6:]]


def truth_d2psi_dF2(F, mu):
    return hessian(lambda x: energy(x, mu), [entry for row in F for entry in row])


mistakes_psi = (
    Mistake(
        "not zero at rest",
        "A sheet at rest stores energy: the three is not subtracted.",
        "What is tr(F^T F) where F is the identity?",
        lambda a: a.right + 1.5 * a.mu,
    ),
)


def conditions_psi(a):
    yield "F is the identity", np.all(a["F"] == np.eye(3), axis=(1, 2))


# tetrahedron and triangle --------------------------------------------------------------------------------------------


def _corners(draw, count):
    while True:
        x = [draw.vector() for _ in range(count)]
        e = [sub(p, x[0]) for p in x[1:]]
        size = norm(cross(e[0], e[1])) if count == 3 else abs(dot(cross(e[0], e[1]), e[2]))
        if size > 0.3:
            return x


def draw_dphi_dX(draw, k):
    return {f"X{i}": x for i, x in enumerate(_corners(draw, 4))}


def _phi(X, corners):
    """Shares of the volume."""

    def volume(a, b, c, d):
        return dot(cross(sub(b, a), sub(c, a)), sub(d, a))

    whole = volume(*corners)
    return [volume(*(X if k == i else p for k, p in enumerate(corners))) / whole for i in range(4)]


def truth_dphi_dX(X0, X1, X2, X3):
    corners = [X0, X1, X2, X3]
    return transpose([derivative(lambda X: _phi(X, corners), X0, k) for k in range(3)])


def draw_deformation_gradient(draw, k):
    q = [entry for x in _corners(draw, 4) for entry in x]
    G = truth_dphi_dX(*_corners(draw, 4))
    return {"q": q, "dphi_dX": G}


def truth_deformation_gradient(q, dphi_dX):
    columns = [[sum(q[3 * k + i] * dphi_dX[k][j] for k in range(4)) for j in range(3)] for i in range(3)]
    return columns


def terms_deformation_gradient(a):
    return size_of(a["q"]) * size_of(a["dphi_dX"])


def draw_edges(draw, k):
    return {f"x{i}": x for i, x in enumerate(_corners(draw, 3))}


def truth_edges(x0, x1, x2):
    e, f = sub(x1, x0), sub(x2, x0)
    return [*e, *f], norm(cross(e, f)) / 2


# descent -------------------------------------------------------------------------------------------------------------


def draw_descend(draw, k):
    rows = [[draw.between(-1, 1) for _ in range(4)] for _ in range(4)]
    A = [[dot(p, q) for q in rows] for p in rows]
    x, b = ([draw.between(-2, 2) for _ in range(4)] for _ in range(2))
    return {"x": x, "step": draw.between(0.1, 1), "A": A, "b": b}


def truth_descend(x, step, A, b):
    way = times(step, add(apply(A, x), b))
    return sub(x, way), norm(way)


mistakes_descend = (
    Mistake("uphill", "You go uphill.", "Which sign leads down?", lambda a: 2 * a.x - a.right),
)


def _agrees(ask):
    rng = np.random.default_rng(3)
    F, d, mu = rng.normal(size=(4, 3, 3)), rng.normal(size=(4, 3, 3)), np.full(4, 3.0)
    ahead, back = (ask("psi", {"F": F + t * d, "mu": mu})[0] for t in (1e-4, -1e-4))
    right = np.einsum("cij,cij->c", ask("dpsi_dF", {"F": F, "mu": mu})[0], d)
    return float(np.abs((ahead - back) / 2e-4 - right).max() / np.abs(right).max()), 1e-6


laws = (Law("stress is the slope of the energy", ("psi", "dpsi_dF"), _agrees),)
