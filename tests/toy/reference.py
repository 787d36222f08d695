"""All that is known of the toy's tasks, in one file: how cases are drawn, what is true, and more."""

import numpy as np

from muslin.judging import Derivative, Law, Line, Mistake, Property
from muslin.judging.differences import CASES, flat, stepped
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
from muslin.judging.relations import again, between, binades, follows, matrices, vanishes
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


def terms_psi(a):
    return a["mu"] * (3 + size_of(a["F"]) ** 2)


def _strained(rng):
    return {"F": matrices(rng, 6), "mu": binades(rng, 2, 8, 6)}


properties_psi = (
    Property(
        "linear in mu",
        "Twice the stiffness must store twice the energy.",
        again(_strained, lambda rng, a: {"mu": 2 * a["mu"]}),
        follows(terms_psi, lambda psi: 2 * psi),
    ),
)
properties_d2psi_dF2 = (
    Property(
        "symmetric",
        "The Hessian must be symmetric.",
        _strained,
        vanishes(None, lambda a, H: H - np.swapaxes(H, 1, 2)),
    ),
)
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


def steps_psi(a):
    return {"tr(F^T F)": np.trace(a["F"].T @ a["F"])}


def _along(io):
    a = {name: array[:CASES] for name, array in io.cases("psi").items()}
    d = io.direction(3, 3)

    def at(t):
        return flat(
            lambda **v: io.best("psi", **v), t.shape[1], F=(stepped(a["F"], t, d), True), mu=(a["mu"], False)
        )

    along = [np.einsum("cij,cij->c", f("dpsi_dF", **a), d) for f in (io.yours, io.true)]
    return Line(at, *along)


derivative_dpsi_dF = Derivative("{psi} psi, moved in F", "central", _along)

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


def _begun(rng):
    A = between(rng, -1, 1, 5, 4, 4)
    vectors = {name: between(rng, -1, 1, 5, 4) for name in ("x", "b")}
    return {**vectors, "A": A @ np.swapaxes(A, 1, 2), "step": between(rng, 0.1, 1, 5)}


properties_descend = (
    Property(
        "the way is what x changes by",
        "How far it is must be the distance between the old x and the new.",
        _begun,
        lambda a, out: np.abs(np.linalg.norm(out[0] - a["x"], axis=1) - out[1]),
    ),
)
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
