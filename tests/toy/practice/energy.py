"""What students may know of the energy: what must hold for every input, what lies on the way, what is its slope."""

import numpy as np

from muslin.judging import Derivative, Line, Property
from muslin.judging.differences import CASES, flat, stepped
from muslin.judging.relations import again, binades, follows, matrices, vanishes
from muslin.tasks.comparing import size_of


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
