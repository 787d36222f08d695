"""Derivatives against differences: the error as a function of the step, and what its slope says.

A difference quotient of step t has two errors: what it leaves out, which shrinks like t (forward) or t^2
(central), and rounding, which grows like 1/t. Together they are a V. A wrong derivative shows no V: its error
stays where it is however small the step. `curves` runs in a worker, as student code does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from muslin.errors import MuslinError

Array = np.ndarray

#: Steps, in units of the size of what is moved.
STEPS = 10.0 ** np.linspace(-0.5, -12, 47)

#: Cases of each task: few, and good ones, since thin triangles make every difference quotient poor.
CASES = 4

ORDERS = {"forward": 1, "central": 2}


@dataclass(frozen=True)
class Line:
    """A function along a line, for several cases at once.

    Attributes
    ----------
    at : callable
        Numbers t (c, k) -> values (c, k, ...).
    yours, right : ndarray (c, ...)
        Its derivative at t = 0, by the student's function and by Muslin.
    """

    at: Callable[[Array], Array]
    yours: Array
    right: Array


@dataclass(frozen=True)
class Curve:
    """What came of one derivative.

    `errors` and `reference` belong to `STEPS`: the student's and the right derivative against the differences,
    relative, the worst of the cases. `slope` is None where there is none: the difference is exact.
    """

    task: str
    words: str
    scheme: str
    errors: Array
    reference: Array
    slope: float | None
    right: bool


class Inputs:
    """Public cases, and functions: the student's where they are right, else the truth."""

    def __init__(self, functions: Any, assignment: str):
        self.functions, self.assignment = functions, assignment
        self.whose: dict[str, str] = {}
        self.rng = np.random.default_rng(1)

    def cases(self, task: str) -> dict[str, Array]:
        """Inputs of a task's public cases."""
        from muslin import reference

        return reference.cases(self.assignment, task)[0]

    def yours(self, task: str, **values: Array) -> Array:
        """The student's answer."""
        from muslin.batch import evaluate

        return np.asarray(evaluate(self.functions[task], **dict[str, Any](values)), dtype=float)

    def true(self, task: str, **values: Array) -> Array:
        """The right answer."""
        from muslin.authoring.truth import truth

        return truth(task, values)[0].astype(float)

    def best(self, task: str, **values: Array) -> Array:
        """The student's answer if that function passes the public cases, else the right one."""
        if task not in self.whose:
            from muslin import reference

            (verdict,) = reference.check(self.functions, [task])
            self.whose[task] = "your" if verdict.ok else "Muslin's"
        return (self.yours if self.whose[task] == "your" else self.true)(task, **values)

    def direction(self, *shape: int) -> Array:
        """Random directions of length one."""
        d = self.rng.normal(size=(CASES, *shape))
        return d / np.linalg.norm(d.reshape(CASES, -1), axis=1).reshape(-1, *[1] * len(shape))


def _moved(base: Array, t: Array, d: Array) -> Array:
    """`base + t d`, (c, k, ...)."""
    grown = t.reshape(*t.shape, *[1] * (base.ndim - 1))
    return base[:, None] + grown * d[:, None]


def _flat(function: Callable[..., Array], count: int, **values: tuple[Array, bool]) -> Array:
    """Call a batch function on values, (c, k, ...) if marked as moving, else (c, ...) and the same for all k."""
    flat = {}
    for name, (value, moving) in values.items():
        value = value if moving else np.repeat(value[:, None], count, axis=1)
        flat[name] = value.reshape(-1, *value.shape[2:])
    out = function(**flat)
    return out.reshape(-1, count, *out.shape[1:])


def _size(*vectors: Array) -> Array:
    return np.max([np.linalg.norm(v, axis=-1) for v in vectors], axis=0)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.sum(a * b, axis=-1))


def _fat(x0: Array, x1: Array, x2: Array) -> Array:
    """Numbers of the triangles that are least thin."""
    a, b = x1 - x0, x2 - x0
    height = np.linalg.norm(np.cross(a, b), axis=1) / _size(a, b, b - a) ** 2
    return np.argsort(-height, kind="stable")[:CASES]


def _dphi_dX(io: Inputs) -> Line:
    a = io.cases("dphi_dX")
    a = {key: value[_fat(*a.values())] for key, value in a.items()}
    d = io.direction(3) * _size(a["X1"] - a["X0"], a["X2"] - a["X0"])[:, None]

    def at(t: Array) -> Array:
        same = {key: (value, False) for key, value in a.items()}
        return _flat(lambda **v: io.best("phi", **v), t.shape[1], X=(_moved(a["X0"], t, d), True), **same)

    along = lambda J: np.einsum("cij,cj->ci", J, d)  # noqa: E731
    return Line(at, along(io.yours("dphi_dX", **a)), along(io.true("dphi_dX", **a)))


def _dn_dx(io: Inputs) -> Line:
    a = io.cases("dn_dx")
    a = {key: value[_fat(a["x0"], a["x1"], a["x2"])] for key, value in a.items()}
    d = io.direction(3) * _size(a["x1"] - a["x0"], a["x2"] - a["x0"])[:, None]

    def at(t: Array) -> Array:
        x = [_moved(a[f"x{k}"], t, d * (a["i"] == k)[:, None]) for k in range(3)]
        m = np.cross(x[1] - x[0], x[2] - x[0])
        return m / np.linalg.norm(m, axis=-1, keepdims=True)

    along = lambda J: np.einsum("cij,cj->ci", J, d)  # noqa: E731
    return Line(at, along(io.yours("dn_dx", **a)), along(io.true("dn_dx", **a)))


def _stretched(io: Inputs) -> dict[str, Array]:
    a = io.cases("dpsi_ds")
    far = np.argsort(-np.abs(a["s"] - 1).max(axis=1), kind="stable")[:CASES]
    return {key: value[far] for key, value in a.items()}


def _dpsi_ds(io: Inputs) -> Line:
    a, d = _stretched(io), io.direction(3)

    def at(t: Array) -> Array:
        return _flat(
            lambda **v: io.best("psi", **v), t.shape[1],
            s=(_moved(a["s"], t, d), True), mu=(a["mu"], False), lam=(a["lam"], False),
        )  # fmt: skip

    return Line(at, _dot(io.yours("dpsi_ds", **a), d), _dot(io.true("dpsi_ds", **a), d))


def _d2psi_ds2(io: Inputs) -> Line:
    a, d = _stretched(io), io.direction(3)

    def at(t: Array) -> Array:
        return _flat(
            lambda **v: io.best("dpsi_ds", **v), t.shape[1],
            s=(_moved(a["s"], t, d), True), mu=(a["mu"], False), lam=(a["lam"], False),
        )  # fmt: skip

    along = lambda H: np.einsum("cij,cj->ci", H, d)  # noqa: E731
    return Line(at, along(io.yours("d2psi_ds2", **a)), along(io.true("d2psi_ds2", **a)))


class Deformed:
    """Triangles with stretches well apart from each other and from 1."""

    def __init__(self, io: Inputs):
        from muslin import given
        from muslin.batch import evaluate

        rng = io.rng
        frames = [np.linalg.qr(rng.normal(size=(CASES, 3, 3)))[0] for _ in range(2)]
        R, Q = (f * np.sign(np.linalg.det(f))[:, None, None] for f in frames)
        s = np.stack([rng.uniform(1.3, 1.6, CASES), rng.uniform(0.6, 0.8, CASES), np.ones(CASES)], axis=1)
        self.F, self.N = (R * s[:, None, :]) @ Q.transpose(0, 2, 1), Q[:, :, 2]
        self.U, self.s, self.V = evaluate(given.svd, F=self.F, N=self.N)
        self.mu, self.lam = np.full(CASES, 1000.0), np.full(CASES, 1500.0)
        self.p = io.true("dpsi_ds", s=self.s, mu=self.mu, lam=self.lam)
        self.H = io.true("d2psi_ds2", s=self.s, mu=self.mu, lam=self.lam)

    def psi(self, io: Inputs, F: Array) -> Array:
        """Psi of F (c, k, 3, 3) through its singular values in the plane."""
        plane = F @ self.V[:, None, :, :2]
        s = np.linalg.svd(plane, compute_uv=False)
        s = np.concatenate([s, np.ones((*s.shape[:-1], 1))], axis=-1)
        return _flat(
            lambda **v: io.best("psi", **v), F.shape[1],
            s=(s, True), mu=(self.mu, False), lam=(self.lam, False),
        )  # fmt: skip

    def stress(self, io: Inputs, F: Array) -> Array:
        """P of F (c, k, 3, 3): U diag(dpsi_ds) V^T with NumPy's decomposition, the normal's stretch last."""
        U, s, Vt = np.linalg.svd(F)
        last = np.abs(np.einsum("ckij,cj->cki", Vt, self.N)).argmax(axis=-1)
        order = np.argsort(np.arange(3) == last[..., None], axis=-1, kind="stable")
        s = np.take_along_axis(s, order, -1)
        U = np.take_along_axis(U, order[..., None, :], -1)
        Vt = np.take_along_axis(Vt, order[..., :, None], -2)
        p = _flat(
            lambda **v: io.best("dpsi_ds", **v), F.shape[1],
            s=(s, True), mu=(self.mu, False), lam=(self.lam, False),
        )  # fmt: skip
        return (U * p[..., None, :]) @ Vt


def _dpsi_dF(io: Inputs) -> Line:
    a = Deformed(io)
    d = io.direction(3, 3)
    d = d - np.einsum("cij,cj,ck->cik", d, a.N, a.N)  # the normal is carried along, not stretched

    def along(P: Array) -> Array:
        return np.einsum("cij,cij->c", P, d)

    values = {"U": a.U, "dpsi_ds": a.p, "V": a.V}
    return Line(
        lambda t: a.psi(io, _moved(a.F, t, d)),
        along(io.yours("dpsi_dF", **values)),
        along(io.true("dpsi_dF", **values)),
    )


def _nodal_force(io: Inputs) -> Line:
    a = Deformed(io)
    d, g = io.direction(3), io.rng.normal(size=(CASES, 3))
    g -= _dot(g, a.N)[:, None] * a.N  # gradients of shape functions lie in the plane
    area, h = np.full(CASES, 0.3), np.full(CASES, 0.01)
    P = (a.U * a.p[:, None, :]) @ a.V.transpose(0, 2, 1)
    values = {"P": P, "grad_phi": g, "area": area, "h": h}

    def at(t: Array) -> Array:
        return (h * area)[:, None] * a.psi(io, _moved(a.F, t, np.einsum("ci,cj->cij", d, g)))

    return Line(at, -_dot(io.yours("nodal_force", **values), d), -_dot(io.true("nodal_force", **values), d))


def _d2psi_dFij(io: Inputs) -> Line:
    from muslin import given
    from muslin.batch import evaluate

    a = Deformed(io)
    i, j = np.array([0, 1, 2, 0])[:CASES], np.array([1, 1, 0, 2])[:CASES]
    d = np.zeros((CASES, 3, 3))
    d[np.arange(CASES), i, j] = 1.0
    dU, ds, dV = evaluate(given.dsvd, U=a.U, s=a.s, V=a.V, i=i.astype(np.int32), j=j.astype(np.int32))
    values = {"U": a.U, "V": a.V, "dpsi_ds": a.p, "d2psi_ds2": a.H, "dU": dU, "ds": ds, "dV": dV}
    return Line(
        lambda t: a.stress(io, _moved(a.F, t, d)),
        io.yours("d2psi_dFij", **values),
        io.true("d2psi_dFij", **values),
    )


#: Derivatives that can be checked: task -> (what is differentiated, scheme, its line).
DERIVATIVES: Mapping[str, tuple[str, str, Callable[[Inputs], Line]]] = {
    "dphi_dX": ("{phi} phi, moved in X", "central", _dphi_dX),
    "dn_dx": ("the unit normal, one vertex moved", "central", _dn_dx),
    "dpsi_ds": ("{psi} psi, moved in s", "forward", _dpsi_ds),
    "d2psi_ds2": ("{dpsi_ds} dpsi_ds, moved in s", "central", _d2psi_ds2),
    "dpsi_dF": ("{psi} psi of the singular values of F, moved in F", "central", _dpsi_dF),
    "nodal_force": ("the energy h a psi with {psi} psi, the vertex moved", "central", _nodal_force),
    "d2psi_dFij": ("the stress with {dpsi_ds} dpsi_ds, one entry of F moved", "central", _d2psi_dFij),
}


def curves(folder: Path, assignment: str, names: tuple[str, ...]) -> Iterator[Curve | tuple[str, str]]:
    """Curves of derivatives; (task, why not) for a function that cannot be run."""
    from muslin import tasks

    functions = tasks.load(folder, tasks.assignment(assignment))
    for name in names:
        words, scheme, make = DERIVATIVES[name]
        io = Inputs(functions, assignment)
        try:
            line = make(io)
        except MuslinError as error:
            yield name, str(error)
            continue
        differences = _differences(line, scheme)
        errors, right = (_error(differences, value) for value in (line.yours, line.right))
        slope = slope_of(errors)
        good = bool(errors.min() <= 10 * right.min() + 1e-9)
        yield Curve(name, words.format(**io.whose), scheme, errors, right, slope if good else None, good)


def _differences(line: Line, scheme: str) -> Array:
    """Difference quotients, (c, k, ...)."""
    t = np.repeat(STEPS[None], CASES, axis=0)
    ahead = line.at(t)
    back = line.at(-t) if scheme == "central" else line.at(0 * t)
    apart = (2 if scheme == "central" else 1) * t
    return (ahead - back) / apart.reshape(*t.shape, *[1] * (ahead.ndim - 2))


def _error(differences: Array, derivative: Array) -> Array:
    """Relative error of each step, the worst case, (k,)."""
    count = len(derivative)
    error = np.linalg.norm((differences - derivative[:, None]).reshape(count, len(STEPS), -1), axis=-1)
    scale = np.abs(differences).reshape(count, -1).max(axis=1)
    return np.nan_to_num((error / scale[:, None]).max(axis=0), nan=np.inf) + 1e-17


def slope_of(errors: Array) -> float | None:
    """Slope of the branch that falls with the step, on logarithmic axes; None if there is none."""
    best = int(errors.argmin())
    falling = np.arange(len(errors)) < best
    falling &= (errors > 20 * errors[best]) & (errors < 0.1)
    if falling.sum() < 4:
        return None
    return float(np.polyfit(np.log10(STEPS[falling]), np.log10(errors[falling]), 1)[0])


def told(curve: Curve) -> list[str]:
    """A curve in words."""
    order = ORDERS[curve.scheme]
    best = int(curve.errors.argmin())
    mark = "ok  " if curve.right else "FAIL"
    head = f"{mark} {curve.task}: compared with {curve.scheme} differences of {curve.words}"
    if not curve.right:
        return [
            head,
            f"     The error stays at {curve.errors.min():.1e} however small the step, where it should fall to "
            f"{curve.reference.min():.0e}: this is not the derivative.",
        ]
    if curve.slope is None:
        return [
            head,
            "     Right. No slope to see: what is differentiated is so simple that the difference is exact, "
            f"and only rounding is left (error {curve.errors.min():.0e}).",
        ]
    verdict = "as it should be" if abs(curve.slope - order) < 0.3 else f"where {order} was expected"
    return [
        head,
        f"     Right. The error falls with slope {curve.slope:.2f}, {verdict} ({curve.scheme} differences: {order}), "
        f"to {curve.errors.min():.0e} at a step of {STEPS[best]:.0e}; from there on rounding grows.",
    ]


def plot(curve: Curve, path: Path) -> Path:
    """Draw the V-curve as a PNG."""
    from muslin import render

    ideal = curve.reference[0] * (STEPS / STEPS[0]) ** ORDERS[curve.scheme]
    seen = ideal > curve.reference.min() / 10
    lines = {
        "a right derivative": (STEPS, curve.reference),
        "yours": (STEPS, curve.errors),
        f"slope {ORDERS[curve.scheme]}": (STEPS[seen], ideal[seen]),
    }
    image = render.line_plot(
        lines, f"{curve.task}: {'right' if curve.right else 'wrong'}", "step", "relative error",
        log_x=True, log_y=True, markers=True,
    )  # fmt: skip
    path.parent.mkdir(parents=True, exist_ok=True)
    return Path(render.write_png(path, image))
