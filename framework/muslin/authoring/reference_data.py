"""Reference data: inputs drawn from a seed, answers from `muslin.authoring.truth`, files that say so.

`data/reference/<assignment>/<task>.npz` holds one array per argument, by its name, and one per result, named
`expected_<result>`; `provenance.json` holds the seed, versions and checksums. Public cases ship with Muslin;
an instructor makes hidden ones with the same command and a secret seed.

Inputs are drawn with Python's `random.Random`, whose stream is guaranteed, and worked out in mpmath before
they are rounded: every machine draws the same bytes. Case k is of kind k of its task, in turn, so a file
covers all kinds whatever the seed. No case sits where a right answer is badly conditioned.
"""

from __future__ import annotations

import functools
import hashlib
import io
import json
import math
import random
import shutil
import zipfile
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

import muslin
from muslin import paths, tasks
from muslin.authoring import truth as tr
from muslin.errors import MuslinError

PROVENANCE = "provenance.json"
GENERATOR = "muslin.authoring.reference_data"

#: Seed and number of cases per task of the public data.
PUBLIC_SEED = "muslin public"
PUBLIC_CASES = 30

#: How closely `verify` wants the outputs reproduced, relative to the largest entry of each case.
REPRODUCED = 1e-15


class Draw(random.Random):
    """A stream of random inputs, as mpf, that is the same on every machine."""

    def between(self, low: float, high: float) -> Any:
        """A number between two others."""
        return tr.precise().mpf(low + (high - low) * self.random())

    def decades(self, low: int, high: int) -> Any:
        """A number between 10^low and 10^high, spread evenly over the decades."""
        return tr.precise().mpf(10) ** self.between(low, high)

    def vector(self, size: float = 1.0) -> tr.Vector:
        """A vec3 with entries between -size and size."""
        return [self.between(-size, size) for _ in range(3)]

    def matrix(self, size: float = 1.0) -> tr.Matrix:
        """A mat3 with entries between -size and size."""
        return [self.vector(size) for _ in range(3)]

    def direction(self) -> tr.Vector:
        """A unit vector."""
        while True:
            v = self.vector()
            if 0.2 < tr.norm(v) < 1:
                return tr.times(1 / tr.norm(v), v)

    def rotation(self) -> tr.Matrix:
        """A rotation: a frame from two directions."""
        while True:
            a, b = self.direction(), self.direction()
            c = tr.cross(a, b)
            if tr.norm(c) > 0.3:
                c = tr.times(1 / tr.norm(c), c)
                return tr.transpose([a, tr.cross(c, a), c])

    def material(self) -> tuple[Any, Any]:
        """Lamé parameters (mu, lam), never near each other, so that swapping them shows."""
        mu = self.decades(2, 5)
        return mu, mu * self.choice((self.between(0.1, 0.7), self.between(1.5, 8)))


# --- stretches and triangles, by kind ----------------------------------------------------------------------

#: Where the two in-plane stretches lie; each kind keeps its gaps 0 or above 1e-2.
STRETCHES: Mapping[str, Callable[[Draw], tuple[Any, Any]]] = {
    "generic": lambda draw: (draw.between(1.05, 1.4), draw.between(0.6, 0.95)),
    "rest": lambda draw: (1, 1),
    "equal and stretched": lambda draw: (draw.between(1.1, 2.5),) * 2,
    "equal and compressed": lambda draw: (draw.between(0.3, 0.9),) * 2,
    "strip: one stretch 1": lambda draw: (draw.between(1.1, 2.0), 1),
    "folded: one stretch 1": lambda draw: (1, draw.between(0.2, 0.9)),
    "both stretched": lambda draw: (draw.between(2.0, 3.0), draw.between(1.1, 1.8)),
    "both compressed": lambda draw: (draw.between(0.5, 0.9), draw.between(0.05, 0.3)),
    "sheared far": lambda draw: (draw.between(2.0, 3.0), draw.between(0.05, 0.3)),
    "nearly rest": lambda draw: (1 + draw.between(0.01, 0.03), 1 - draw.between(0.01, 0.03)),
}

#: How a triangle lies: (longest edge over height, size [m], distance from the origin [m]).
LIES: tuple[tuple[str, float, float, float], ...] = (
    ("generic", 1, 1.0, 1.0),
    ("far from the origin", 1, 1.0, 300.0),
    ("small, as in a cloth", 1, 0.03, 1.0),
    ("thin", 30, 1.0, 0.5),
    ("large", 1, 20.0, 10.0),
    ("at the origin", 1, 1.0, 0.0),
    ("thin and small", 10, 0.05, 2.0),
)


def _flat(draw: Draw, thin: float, size: float) -> list[tr.Vector]:
    """A counterclockwise triangle in the plane z = 0, neither slimmer nor rounder than asked."""
    zero = tr.precise().zero
    while True:
        y = [[size * draw.between(-1, 1), size * draw.between(-1, 1), zero] for _ in range(3)]
        edges = [tr.sub(y[(k + 1) % 3], y[k]) for k in range(3)]
        lengths = [tr.norm(e) for e in edges]
        double_area = tr.cross(edges[0], edges[1])[2]
        if double_area > 0.4 * max(lengths) ** 2 and min(lengths) > 0.5 * size:
            return [[p[0], p[1] / thin, zero] for p in y]


def _triangle(draw: Draw, k: int) -> dict[str, Any]:
    """Undeformed and deformed triangle number k: X0..X2, x0..x2, rounded to float64, as exact numbers."""
    _, thin, size, distance = LIES[k % len(LIES)]
    s = list(STRETCHES.values())[k % len(STRETCHES)](draw)
    y = _flat(draw, thin, size)
    turn, other = (_turn(draw), _turn(draw))
    stretch = tr.matmul(tr.matmul(turn, tr.diagonal([*s, tr.precise().one])), tr.transpose(other))
    if s == (1, 1):  # a rigid motion
        stretch = tr.diagonal([tr.precise().one] * 3)
    placed = {}
    for letter, points in (("X", y), ("x", [tr.apply(stretch, p) for p in y])):
        R, t = draw.rotation(), tr.times(tr.precise().mpf(distance), draw.vector())
        for i, p in enumerate(points):
            placed[f"{letter}{i}"] = _float64(tr.add(tr.apply(R, p), t))
    return placed


def _turn(draw: Draw) -> tr.Matrix:
    """A rotation of the plane z = 0."""
    one, zero = tr.precise().one, tr.precise().zero
    while True:
        a, b = draw.between(-1, 1), draw.between(-1, 1)
        r = tr.precise().sqrt(a * a + b * b)
        if r > 0.1:
            return [[a / r, -b / r, zero], [b / r, a / r, zero], [zero, zero, one]]


def _float64(values: Any) -> Any:
    """Rounded to float64, kept as exact numbers."""
    return tr.exact(tr.rounded(values))


def _coarse(value: Any, quantum: float) -> Any:
    """Nearest multiple of a power of two."""
    return tr.precise().floor(value / quantum + tr.precise().mpf(0.5)) * quantum


def _gradients(X0: tr.Vector, X1: tr.Vector, X2: tr.Vector) -> tr.Matrix:
    """Gradients of the shape functions that sum to zero exactly, also after rounding to float64."""
    rows = tr.TRUTH["dphi_dX"](X0, X1, X2)
    largest = max(abs(float(entry)) for row in rows for entry in row)
    quantum = math.ldexp(1.0, math.frexp(largest)[1] - 50)
    g1, g2 = ([_coarse(entry, quantum) for entry in row] for row in rows[1:])
    return [[-p - q for p, q in zip(g1, g2, strict=True)], g1, g2]


def _weights(draw: Draw, spread: float = 1.0) -> tr.Vector:
    """Shape functions inside (spread 1) or around the triangle, whose sum is exactly one in float64."""
    a, b = sorted(draw.random() for _ in range(2))
    middle = 1 / 3
    phi1, phi2 = (_coarse(tr.precise().mpf(middle + spread * (p - middle)), 2.0**-40) for p in (a, b - a))
    return [1 - phi1 - phi2, phi1, phi2]


def _state(draw: Draw, k: int, energy: str | None = None) -> dict[str, Any]:
    """Stretches number k with Lamé parameters, and the derivatives of one of the energies there."""
    one = tr.precise().one
    s = _float64([*list(STRETCHES.values())[k % len(STRETCHES)](draw), one])
    mu, lam = _float64(list(draw.material()))
    of = tr.ENERGIES[energy or ("linearised", "area")[k // len(STRETCHES) % 2]]
    return {
        "s": s,
        "mu": mu,
        "lam": lam,
        "dpsi_ds": tr.gradient(lambda t: of(t, mu, lam), s),
        "d2psi_ds2": tr.hessian(lambda t: of(t, mu, lam), s),
    }


def _pick(values: Mapping[str, Any], *names: str) -> dict[str, Any]:
    return {name: values[name] for name in names}


# --- inputs, task by task: case k of a stream --------------------------------------------------------------


def _phi(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside, outside, above and below the plane, at a vertex, at the middle of an edge."""
    T = _triangle(draw, k)
    X012 = [T["X0"], T["X1"], T["X2"]]
    half, zero, one = tr.precise().mpf(0.5), tr.precise().zero, tr.precise().one
    weights = (
        _weights(draw),
        _weights(draw, 4),
        [[one, zero, zero], [zero, one, zero], [zero, zero, one]][k // 4 % 3],
        [[half, half, zero], [zero, half, half], [half, zero, half]][k // 4 % 3],
    )[k % 4]
    X = tr.TRUTH["interpolate"](weights, *X012)
    size = tr.norm(tr.sub(T["X1"], T["X0"]))
    if k % 4 < 2:
        X = tr.add(X, tr.times(draw.between(-0.5, 0.5) * size, tr.unit_normal(*X012)))
    return {"X": X, **_pick(T, "X0", "X1", "X2")}


def _dphi_dX(draw: Draw, k: int) -> dict[str, Any]:
    return _pick(_triangle(draw, k), "X0", "X1", "X2")


def _interpolate(draw: Draw, k: int) -> dict[str, Any]:
    """Points inside and outside, and at each vertex."""
    at_vertex = tr.exact([[1, 0, 0], [0, 1, 0], [0, 0, 1]])
    phi = at_vertex[k // 4 % 3] if k % 4 == 3 else _weights(draw, (1, 1, 3)[k % 4])
    return {"phi": phi, **_pick(_triangle(draw, k), "x0", "x1", "x2")}


def _deformation_gradient(draw: Draw, k: int) -> dict[str, Any]:
    T = _triangle(draw, k)
    X = [T["X0"], T["X1"], T["X2"]]
    return {**_pick(T, "x0", "x1", "x2"), "dphi_dX": _gradients(*X), "N": tr.unit_normal(*X)}


def _dn_dx(draw: Draw, k: int) -> dict[str, Any]:
    return {**_pick(_triangle(draw, k), "x0", "x1", "x2"), "i": k % 3}


def _sheet(draw: Draw) -> dict[str, Any]:
    return {"area": draw.decades(-4, 0), "rho": draw.decades(0, 3), "h": draw.decades(-4, 0)}


def _mass_block(draw: Draw, k: int) -> dict[str, Any]:
    """All nine blocks in turn."""
    return {"i": k % 3, "j": k // 3 % 3, **_sheet(draw)}


def _kinetic_energy(draw: Draw, k: int) -> dict[str, Any]:
    """Any velocities; all the same; one vertex alone; at rest."""
    v, still = [draw.vector(5) for _ in range(3)], tr.exact([0, 0, 0])
    if k % 6 == 1:
        v = [v[0]] * 3
    elif k % 6 in (2, 3, 4):
        v = [v[i] if i == k % 6 - 2 else still for i in range(3)]
    elif k == 5:
        v = [still] * 3
    return {**{f"v{i}": v[i] for i in range(3)}, **_sheet(draw)}


def _right_cauchy_green(draw: Draw, k: int) -> dict[str, Any]:
    """Deformation gradients of cloth, rotations, and any matrix (so that F F^T shows)."""
    s = [*list(STRETCHES.values())[k % len(STRETCHES)](draw), tr.precise().one]
    F = tr.matmul(tr.matmul(draw.rotation(), tr.diagonal(s)), tr.transpose(draw.rotation()))
    return {"F": draw.matrix(2) if k % 4 == 3 else F}


def _stretches(draw: Draw, k: int) -> dict[str, Any]:
    """In-plane stretches of every kind; now and then a third that is not 1, which must not matter."""
    inputs = _pick(_state(draw, k), "s", "mu", "lam")
    if k % 10 == 9:
        inputs["s"] = [*inputs["s"][:2], _float64(draw.between(0.5, 1.8))]
    return inputs


def _dpsi_dF(draw: Draw, k: int) -> dict[str, Any]:
    """The stress of both energies, and pure compression, tension and shear."""
    p = _state(draw, k)["dpsi_ds"]
    if k % 6 == 5:
        p = [draw.between(-1, 1), draw.between(-1, 1), tr.precise().zero]
    return {"U": draw.rotation(), "dpsi_ds": p, "V": draw.rotation()}


def _nodal_force(draw: Draw, k: int) -> dict[str, Any]:
    """The stress and shape gradients of a triangle, and any others."""
    stress = _dpsi_dF(draw, k)
    T = _triangle(draw, k)
    P = tr.matmul(tr.matmul(stress["U"], tr.diagonal(stress["dpsi_ds"])), tr.transpose(stress["V"]))
    sheet = _sheet(draw)
    return {
        "P": draw.matrix(100) if k % 5 == 4 else P,
        "grad_phi": _gradients(T["X0"], T["X1"], T["X2"])[k % 3],
        "area": sheet["area"],
        "h": sheet["h"],
    }


def _d2psi_dFij(draw: Draw, k: int) -> dict[str, Any]:
    """The derivatives of a real singular value decomposition, with all stretches apart, and any others."""
    state = _state(draw, k)
    U, V = draw.rotation(), draw.rotation()
    given = {"U": U, "V": V, **_pick(state, "dpsi_ds", "d2psi_ds2")}
    if k % 4 == 3:
        return {**given, "dU": draw.matrix(), "ds": draw.vector(), "dV": draw.matrix()}
    s = [draw.between(1.2, 3), draw.between(0.05, 0.8), tr.precise().one]
    given["dpsi_ds"] = tr.gradient(lambda t: tr.linearised(t, state["mu"], state["lam"]), s)
    given["d2psi_ds2"] = tr.hessian(lambda t: tr.linearised(t, state["mu"], state["lam"]), s)
    i, j = k % 3, k // 3 % 3
    return {**given, **_dsvd(U, s, V, i, j)}


def _dsvd(U: tr.Matrix, s: tr.Vector, V: tr.Matrix, i: int, j: int) -> dict[str, Any]:
    """Derivatives of U, s and V in F_ij: A = W diag(s) + diag(ds) - diag(s) Z with A = U^T (dF/dF_ij) V."""
    A = [[U[i][k] * V[j][m] for m in range(3)] for k in range(3)]
    W, Z = tr.exact([[0] * 3] * 3), tr.exact([[0] * 3] * 3)
    for k in range(3):
        for m in range(3):
            if k != m:
                W[k][m] = (s[m] * A[k][m] + s[k] * A[m][k]) / (s[m] ** 2 - s[k] ** 2)
                Z[k][m] = (s[k] * A[k][m] + s[m] * A[m][k]) / (s[m] ** 2 - s[k] ** 2)
    return {"dU": tr.matmul(U, W), "ds": [A[k][k] for k in range(3)], "dV": tr.matmul(V, Z)}


def _eigensystem(draw: Draw, k: int) -> dict[str, Any]:
    return _pick(_state(draw, k), "s", "dpsi_ds", "d2psi_ds2")


def _sphere_contact(draw: Draw, k: int) -> dict[str, Any]:
    """Just inside, just outside, deep inside, far away, at the very centre, exactly on the surface (no hit)."""
    if k % 10 == 8:  # (3, 4, 0) has length 5: all of it exact, however it is computed
        unit = 2.0 ** draw.randint(-4, 2)
        c = [unit * draw.randint(-9, 9) for _ in range(3)]
        turned = draw.sample([3 * unit, 4 * unit, 0.0], 3)
        return {"x": [a + b for a, b in zip(c, turned, strict=True)], "c": c, "r": 5 * unit}
    c, r = _float64(draw.vector(3)), draw.decades(-2, 1)
    share = (draw.between(0.6, 0.95), draw.between(1.05, 1.5), draw.between(0.01, 0.5), draw.between(2, 9))[
        k % 4
    ]
    x = c if k % 10 == 9 else tr.add(c, tr.times(share * r, draw.direction()))
    return {"x": x, "c": c, "r": r}


def _filter_velocity(draw: Draw, k: int) -> dict[str, Any]:
    """Into the obstacle, away from it, exactly along it, straight into it, straight away, at rest."""
    n = _float64(draw.direction())
    along = tr.cross(n, draw.direction())
    into = draw.between(0.1, 3)
    v = tr.add(along, tr.times((-into, into)[k % 2], n))
    if k % 6 == 2:
        axis, sign = k // 6 % 3, (1, -1)[k // 6 % 2]
        n = tr.exact([sign if m == axis else 0 for m in range(3)])
        v = [tr.precise().zero if m == axis else entry for m, entry in enumerate(draw.vector(3))]
    elif k % 6 in (3, 4):
        v = tr.times((-into, into)[k % 6 - 3], n)
    elif k == 5:
        v = tr.exact([0, 0, 0])
    return {"v": v, "n": n}


INPUTS: Mapping[str, Mapping[str, Callable[[Draw, int], dict[str, Any]]]] = {
    "cloth": {
        "phi": _phi,
        "dphi_dX": _dphi_dX,
        "interpolate": _interpolate,
        "deformation_gradient": _deformation_gradient,
        "dn_dx": _dn_dx,
        "mass_block": _mass_block,
        "kinetic_energy": _kinetic_energy,
        "right_cauchy_green": _right_cauchy_green,
        "psi": _stretches,
        "dpsi_ds": _stretches,
        "d2psi_ds2": _stretches,
        "dpsi_dF": _dpsi_dF,
        "nodal_force": _nodal_force,
        "d2psi_dFij": _d2psi_dFij,
        "eigensystem": _eigensystem,
        "sphere_contact": _sphere_contact,
        "filter_velocity": _filter_velocity,
    }
}


def own(assignment_name: str, function: str) -> Callable[..., Any] | None:
    """A function of the assignment's own `reference.py`, if there is one.

    For a task, `draw_<task>(draw, k)` gives the arguments of case k by name, from a `Draw`, and
    `truth_<task>(...)` the right answer, both in exact numbers. They come before what is built in.

    Raises
    ------
    MuslinError
        If the file cannot be run.
    """
    path = paths.generator(assignment_name)
    if not path.is_file():
        return None
    return getattr(_module(path, path.stat().st_mtime_ns), function, None)


@functools.lru_cache(maxsize=8)
def _module(path: Path, changed: int) -> ModuleType:
    module = ModuleType(f"muslin_reference_{path.parent.name}")
    module.__file__ = str(path)
    try:
        exec(compile(path.read_text(encoding="utf-8"), path, "exec", dont_inherit=True), module.__dict__)
    except Exception as error:
        raise MuslinError(f"{paths.shown(path)} fails: {type(error).__name__}: {error}.") from None
    return module


def draw_inputs(assignment_name: str, task: str, seed: int | str, cases: int) -> dict[str, np.ndarray]:
    """Inputs of a task: case k of every kind in turn, drawn from a stream of the task's own.

    Parameters
    ----------
    assignment_name, task : str
        Which task.
    seed : int or str
        What the stream is drawn from.
    cases : int
        How many.

    Returns
    -------
    dict of ndarray, (cases, ...)
        float64, or int32 where the task takes an integer.

    Raises
    ------
    MuslinError
        If nobody has written how to draw inputs of this task.
    """
    generate = own(assignment_name, f"draw_{task}") or INPUTS.get(assignment_name, {}).get(task)
    if generate is None:
        hint = f"Write draw_{task}(draw, k) in {paths.shown(paths.generator(assignment_name))}."
        raise MuslinError(f"Nothing draws inputs for {assignment_name}/{task}.", hint)
    draw = Draw(f"{seed}/{assignment_name}/{task}")
    drawn = [generate(draw, k) for k in range(cases)]
    arrays = {}
    for argument in tasks.assignment(assignment_name).tasks[task].arguments:
        shape, integer = tasks.KINDS[argument.kind]
        column = [case[argument.name] for case in drawn]
        array = np.array(column, dtype=np.int32) if integer else tr.rounded(column)
        arrays[argument.name] = array.reshape(cases, *shape)
    return arrays


def make(assignment_name: str, task: str, seed: int | str, cases: int) -> dict[str, np.ndarray]:
    """All arrays of one task's file: its inputs, and its results as `expected_<name>`."""
    inputs = draw_inputs(assignment_name, task, seed, cases)
    results = tasks.assignment(assignment_name).tasks[task].results
    expected = tr.truth(task, inputs, own(assignment_name, f"truth_{task}"))
    names = [f"expected_{value.name}" for value in results]
    return {**inputs, **dict(zip(names, expected, strict=True))}


def build(
    assignment_name: str = "cloth",
    out_folder: Path | str | None = None,
    seed: int | str = PUBLIC_SEED,
    cases: int = PUBLIC_CASES,
    hidden: bool = False,
    only: Collection[str] = (),
) -> Path:
    """Write the reference data of an assignment.

    Parameters
    ----------
    assignment_name : str
        Which assignment.
    out_folder : path, optional
        Where to; default the public data.
    seed : int or str
        Keep it secret for hidden cases: it is written into the folder's provenance.
    cases : int
        Cases per task.
    hidden : bool
        Hidden data: they need a seed and a folder of their own, which nobody but their owner can read.
    only : collection of str
        Tasks to make data for, what is there of all others stays as it is. Default: all tasks.

    Returns
    -------
    Path
        The folder written.

    Raises
    ------
    MuslinError
        If hidden data would have no secret seed or lie among files that students get.
    """
    if hidden:
        _require_secret(assignment_name, out_folder, seed)
    tr.precise()  # says what to install, if need be
    import mpmath

    folder = Path(out_folder) if out_folder is not None else paths.reference(assignment_name)
    folder.mkdir(parents=True, exist_ok=True)
    if hidden:
        folder.chmod(0o700)
    kept = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))["files"] if only else {}
    files = {}
    for task in tasks.assignment(assignment_name).tasks:
        if only and task not in only:
            files[f"{task}.npz"] = kept[f"{task}.npz"]
            continue
        arrays = make(assignment_name, task, seed, cases)
        _write_npz(folder / f"{task}.npz", arrays)
        files[f"{task}.npz"] = {"cases": cases, "sha256": _checksum(arrays)}
    if not hidden:
        if not only:
            _write_simulation(assignment_name, folder)
        if (generator := paths.generator(assignment_name)).is_file() and folder != generator.parent:
            shutil.copyfile(generator, folder / generator.name)  # so that graders without solutions have it
    provenance = {
        "assignment": assignment_name,
        "generator": GENERATOR,
        "muslin": muslin.__version__,
        "mpmath": mpmath.__version__,
        "digits": tr.DIGITS,
        "seed": seed,
        "files": files,
    }
    (folder / PROVENANCE).write_text(json.dumps(provenance, indent=2) + "\n", encoding="utf-8")
    return folder


def _require_secret(assignment_name: str, out_folder: Path | str | None, seed: int | str) -> None:
    if seed == PUBLIC_SEED or not str(seed).strip():
        raise MuslinError("Hidden data need a secret seed.", "Add --seed with words nobody will guess.")
    if out_folder is None:
        raise MuslinError("Hidden data need a folder of their own.", "Add --out DIR.")
    folder = Path(out_folder).resolve()
    for shipped in (paths.root() / "data", paths.root() / "assignments"):
        if folder.is_relative_to(shipped.resolve()):
            raise MuslinError(
                f"{paths.shown(folder)} is among the files students get.", "Choose another folder for --out."
            )


def _simulated(assignment_name: str) -> Path | None:
    """Where the reference run of an assignment lies under its data, if the assignment has one."""
    from muslin.grading import simulating

    return Path("simulation") / f"{simulating.SCENE}.npz" if assignment_name == "cloth" else None


def _write_simulation(assignment_name: str, folder: Path) -> None:
    """The run that submissions' simulations are compared with: by the framework's own element, not the solution."""
    from muslin.grading import simulating

    if (place := _simulated(assignment_name)) is not None:
        (folder / place).parent.mkdir(exist_ok=True)
        _write_npz(folder / place, simulating.make_reference())


@dataclass
class Report:
    """What `verify` found: `errors` is the largest relative difference per task, `problems` are sentences."""

    folder: Path
    errors: dict[str, float] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems


def verify(
    assignment_name: str = "cloth", folder: Path | str | None = None, regenerate: bool = True
) -> Report:
    """Make reference data again from the seed on record and compare.

    Inputs must come out byte for byte, outputs to `REPRODUCED`; checksums and the list of files must agree.

    Parameters
    ----------
    assignment_name : str
        Which assignment.
    folder : path, optional
        Default the public data.
    regenerate : bool
        False compares checksums and the list of files only.

    Returns
    -------
    Report
        `report.ok`, and `report.problems` in words.

    Raises
    ------
    MuslinError
        If the folder has no readable provenance.
    """
    folder = Path(folder) if folder is not None else paths.reference(assignment_name)
    try:
        provenance = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
        seed, files = provenance["seed"], provenance["files"]
    except (OSError, ValueError, KeyError) as error:
        where = paths.shown(folder / PROVENANCE)
        raise MuslinError(f"{where} cannot be read ({error}).", "Build the reference data first.") from None
    report = Report(folder)
    expected = {f"{task}.npz" for task in tasks.assignment(assignment_name).tasks}
    for name in sorted(expected ^ set(files)):
        report.problems.append(f"{name}: {'not on record' if name in expected else 'no such task'}.")
    for name in sorted(expected & set(files)):
        try:
            with np.load(folder / name, allow_pickle=False) as data:
                found = {key: data[key] for key in data.files}
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            report.problems.append(f"{name}: cannot be read ({error}).")
            continue
        if _checksum(found) != files[name]["sha256"]:
            report.problems.append(f"{name}: its content is not what the provenance says (sha256 differs).")
        if not regenerate:
            continue
        task = name.removesuffix(".npz")
        made = make(assignment_name, task, seed, files[name]["cases"])
        report.errors[task] = _compare(name, found, made, report.problems)
    if folder != paths.reference(assignment_name):
        return report
    generator, copy = paths.generator(assignment_name), folder / paths.generator(assignment_name).name
    if generator.is_file() and not (copy.is_file() and copy.read_bytes() == generator.read_bytes()):
        report.problems.append(f"{copy.name}: not the one the solution has.")
    if regenerate and (place := _simulated(assignment_name)) is not None:
        report.problems += _verify_simulation(assignment_name, str(place))
    return report


def _verify_simulation(assignment_name: str, name: str) -> list[str]:
    """Run the reference simulation again; only its first steps are comparable between machines."""
    from muslin.grading import simulating

    found, made = simulating.reference(assignment_name), simulating.make_reference()
    if found is None:
        return [f"{name}: missing."]
    rows = simulating.COMPARED_STEPS + 1
    error, tolerance = simulating.compare_energies(found["energies"][:rows], made["energies"][:rows])
    same = np.array_equal(found["triangles"], made["triangles"]) and error <= tolerance
    return [] if same else [f"{name}: the simulation differs (energies by {error:.1e}, relative)."]


def _compare(
    name: str, found: Mapping[str, np.ndarray], made: Mapping[str, np.ndarray], problems: list[str]
) -> float:
    """Largest relative difference of the outputs; what is wrong goes to `problems`."""
    worst = 0.0
    for key in sorted(set(found) | set(made)):
        if key not in found or key not in made:
            problems.append(f"{name}: {key} is {'missing' if key in made else 'unknown'}.")
        elif found[key].shape != made[key].shape or found[key].dtype != made[key].dtype:
            problems.append(f"{name}: {key} has another shape or type than the generator makes.")
        elif not key.startswith("expected_"):
            if found[key].tobytes() != made[key].tobytes():
                problems.append(f"{name}: {key} is not what the seed gives.")
        else:
            flat = made[key].reshape(len(made[key]), -1).astype(float)
            difference = np.abs(found[key].reshape(flat.shape) - flat).max(axis=1)
            scale = np.abs(flat).max(axis=1)
            error = float(np.max(difference / np.where(scale > 0, scale, 1.0), initial=0.0))
            worst = max(worst, error)
            if not error <= REPRODUCED:
                problems.append(f"{name}: {key} differs from the truth by {error:.1e} (relative).")
    return worst


def _checksum(arrays: Mapping[str, np.ndarray]) -> str:
    """sha256 of names, types, shapes and little-endian bytes."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        array = array.astype(array.dtype.newbyteorder("<"), copy=False)
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _write_npz(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """`numpy.savez`, with the same bytes on every machine: no time stamps, nothing compressed."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            little = np.ascontiguousarray(array)
            little = little.astype(little.dtype.newbyteorder("<"), copy=False)
            np.lib.format.write_array(buffer, little, version=(1, 0), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.create_system = 3
            archive.writestr(entry, buffer.getvalue())
