"""One public case of a task, step by step: inputs, what lies on the way, the student's variables, the result.

`steps` runs in a worker, as student code does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from muslin.errors import MuslinError

Values = Mapping[str, np.ndarray]


def _unit_normal(a: Any, b: Any, c: Any) -> Any:
    m = np.cross(b - a, c - a)
    return m / np.linalg.norm(m)


def _triangle(a: Values, X: str = "X") -> dict[str, Any]:
    D = np.stack([a[f"{X}1"] - a[f"{X}0"], a[f"{X}2"] - a[f"{X}0"]], axis=1)
    m = np.cross(D[:, 0], D[:, 1])
    return {"D": D, "D^T D": D.T @ D, "m": m, "|m|": np.linalg.norm(m)}


def _deformed(a: Values) -> dict[str, Any]:
    m = np.cross(a["x1"] - a["x0"], a["x2"] - a["x0"])
    return {"m = (x1-x0) x (x2-x0)": m, "|m|": np.linalg.norm(m), "n": m / np.linalg.norm(m)}


def _edges(a: Values) -> dict[str, Any]:
    x, i = [a["x0"], a["x1"], a["x2"]], int(a["i"])
    n = _unit_normal(*x)
    return {
        "edge opposite vertex i": x[(i + 2) % 3] - x[(i + 1) % 3],
        "I - n n^T": np.eye(3) - np.outer(n, n),
    }


def _svd(F: np.ndarray) -> dict[str, Any]:
    s = np.linalg.svd(F, compute_uv=False)
    return {"singular values of F": s, "their squares": s * s, "det F": np.linalg.det(F)}


def _stretches(a: Values) -> dict[str, Any]:
    s = a["s"]
    return {"s0 - 1": s[0] - 1, "s1 - 1": s[1] - 1, "s0 + s1 - 2": s[0] + s[1] - 2}


def _modes(a: Values) -> dict[str, Any]:
    s, p, H = a["s"], a["dpsi_ds"], a["d2psi_ds2"]
    return {
        "s0 - s1": s[0] - s[1], "s0 + s1": s[0] + s[1],
        "psi_0 - psi_1": p[0] - p[1], "psi_0 + psi_1": p[0] + p[1], "psi_00 - psi_01": H[0, 0] - H[0, 1],
    }  # fmt: skip


#: What lies on the way from the inputs to the result, in the handout's symbols: task -> inputs -> values.
ON_THE_WAY: Mapping[str, Callable[[Values], dict[str, Any]]] = {
    "phi": lambda a: _triangle(a) | {"X - X0": a["X"] - a["X0"]},
    "dphi_dX": _triangle,
    "deformation_gradient": _deformed,
    "dn_dx": lambda a: _deformed(a) | _edges(a),
    "mass_block": lambda a: {"rho h area": a["rho"] * a["h"] * a["area"]},
    "kinetic_energy": lambda a: {
        "rho h area": a["rho"] * a["h"] * a["area"],
        "v0.v0, v1.v1, v2.v2": np.array([a[f"v{k}"] @ a[f"v{k}"] for k in range(3)]),
        "v0.v1, v1.v2, v2.v0": np.array([a[f"v{k}"] @ a[f"v{(k + 1) % 3}"] for k in range(3)]),
    },
    "right_cauchy_green": lambda a: _svd(a["F"]),
    "psi": _stretches,
    "dpsi_ds": _stretches,
    "dpsi_dF": lambda a: {"Psi_s = diag(dpsi_ds)": np.diag(a["dpsi_ds"])},
    "nodal_force": lambda a: {"P grad_phi": a["P"] @ a["grad_phi"]},
    "d2psi_dFij": lambda a: {
        "Psi_s = diag(dpsi_ds)": np.diag(a["dpsi_ds"]),
        "ds_ij = d2psi_ds2 ds": a["d2psi_ds2"] @ a["ds"],
    },
    "eigensystem": _modes,
    "sphere_contact": lambda a: {"x - c": a["x"] - a["c"], "|x - c|": np.linalg.norm(a["x"] - a["c"])},
    "filter_velocity": lambda a: {"d = n^T v": a["n"] @ a["v"]},
}

#: The whole way of one triangle: symbol, task, its arguments by symbol; in the order of the handout.
CHAIN: tuple[tuple[str, str, Mapping[str, str]], ...] = (
    ("dphi_dX", "dphi_dX", {"X0": "X0", "X1": "X1", "X2": "X2"}),
    ("F", "deformation_gradient", {"x0": "x0", "x1": "x1", "x2": "x2", "dphi_dX": "dphi_dX", "N": "N"}),
    ("C", "right_cauchy_green", {"F": "F"}),
    ("psi", "psi", {"s": "s", "mu": "mu", "lam": "lam"}),
    ("dpsi_ds", "dpsi_ds", {"s": "s", "mu": "mu", "lam": "lam"}),
    ("d2psi_ds2", "d2psi_ds2", {"s": "s", "mu": "mu", "lam": "lam"}),
    ("P", "dpsi_dF", {"U": "U", "dpsi_ds": "dpsi_ds", "V": "V"}),
    ("f_0", "nodal_force", {"P": "P", "grad_phi": "grad_phi_0", "area": "area", "h": "h"}),
    ("modes", "eigensystem", {"s": "s", "dpsi_ds": "dpsi_ds", "d2psi_ds2": "d2psi_ds2"}),
)


def steps(folder: Path, assignment: str, name: str, case: int | None) -> Iterator[str]:
    """Lines that explain a case of a task; without a number, the simplest wrong one, or the first.

    Raises
    ------
    MuslinError
        If there is no such case, or the function cannot be run.
    """
    from muslin import reading, reference, tasks
    from muslin.batch import evaluate

    table = tasks.assignment(assignment)
    task = table.tasks[name]
    functions = tasks.load(folder, table)
    inputs, expected = reference.cases(assignment, name)
    count = len(expected[0])
    if case is not None and not 0 <= case < count:
        raise MuslinError(f"{name} has public cases 0 to {count - 1}, not {case}.")
    got: tuple[Any, ...] | None = None
    trouble = ""
    try:
        answer = evaluate(functions[name], **dict[str, Any](inputs))
        got = answer if isinstance(answer, tuple) else (answer,)
    except MuslinError as error:
        trouble = str(error)
    verdict = reference.compare(task, got, expected, inputs) if got is not None else None
    if case is None:
        case = verdict.case if verdict is not None and verdict.case is not None else 0

    def known(k: int) -> tuple[Values, Values, Values]:
        """Inputs, results, and all that is known of a case."""
        here = {key: value[k] for key, value in inputs.items()}
        results = {v.name: e[k] for v, e in zip(task.results, expected, strict=True)}
        return here, results, {**here, **ON_THE_WAY.get(name, lambda a: {})(here)}

    here, results, way = known(case)

    yield f"{name}: {task.title}; case {case} of 0 to {count - 1}"
    yield from _titled("Inputs", here)
    yield from _titled(
        "On the way, in the handout's symbols", {k: v for k, v in way.items() if k not in here}
    )
    if got is None:
        yield ""
        yield "Your function does not run yet"
        yield from (f"  {line}" for line in trouble.split("\n"))
        yield from _titled("Expected", results)
    else:
        others = [known(k) for k in range(0, count, max(1, count // 4)) if k != case]
        cases = [(inputs_there, {**way_there, **right}) for inputs_there, right, way_there in others]
        mine_here = [g[case] for g in got]
        yield from _variables(folder / task.file, name, here, {**way, **results}, mine_here, cases)
        for entry, mine, right in zip(task.results, got, expected, strict=True):
            yield ""
            yield from _beside(entry.name if len(expected) > 1 else "Result", mine[case], right[case])
        assert verdict is not None
        yield from _verdict(table.tasks[name], got, expected, inputs, verdict, assignment)
        if not verdict.ok:
            yield from (f"  look: {note}" for note in reading.told(functions[name]))
    yield from _whole(functions, assignment, name, case)


def _verdict(
    task: Any, got: Any, expected: Any, inputs: Values, verdict: Any, assignment: str
) -> Iterator[str]:
    yield ""
    if verdict.ok:
        yield f"All of your answers are right: {verdict.message}"
        return
    yield f"{verdict.message.splitlines()[0]}."
    from muslin.grading.diagnosis import diagnose

    found = diagnose(task, got, expected, inputs, assignment)
    if found is not None:
        yield f"likely: {found.mistake}"
        yield f"   try: {found.advice}"


def _elsewhere(
    file: Path, name: str, found: Sequence[tuple[int, str, Any]], cases: Sequence[tuple[Values, Values]]
) -> list[tuple[list[np.ndarray], Values]]:
    """The same variables in other cases, beside what is known there; cases in which other lines run are left out."""
    from muslin.student import plain

    there = []
    for inputs, way in cases:
        try:
            _, others = plain.values(file, name, dict(inputs))
        except Exception:  # a division by zero, say
            continue
        if [entry[:2] for entry in others] == [entry[:2] for entry in found]:
            there.append(([np.asarray(value) for _, _, value in others], way))
    return there


def _variables(
    file: Path,
    name: str,
    here: Values,
    way: Values,
    got: list[np.ndarray],
    cases: Sequence[tuple[Values, Values]],
) -> Iterator[str]:
    """The student's variables, and which quantity each is; and where Python and Taichi part.

    `cases` are the inputs of a few other cases, and what is known there.
    """
    from muslin.student import plain

    try:
        result, found = plain.values(file, name, dict(here))
        back = result if isinstance(result, tuple) else (result,)
    except Exception as error:  # a view into the function is a help, not a duty
        yield ""
        yield f"(Your variables cannot be shown: {type(error).__name__}: {error}.)"
        return
    if found:
        yield ""
        yield "Your variables, line by line"
        others = _elsewhere(file, name, found, cases)
        for number, (line, variable, what_it_holds) in enumerate(found):
            value = np.asarray(what_it_holds)
            what = _recognised(value, {k: v for k, v in way.items() if k != variable})
            for elsewhere, their_way in others:  # two quantities may agree by chance in one case, not in all
                if np.any(elsewhere[number]):
                    what = [label for label in what if label in _recognised(elsewhere[number], their_way)]
            note = f"   this is {what[0]}" if what else ""
            rows = _rows(value)
            yield f"  line {line:<4} {variable} = {rows[0]}{note if len(rows) == 1 else ''}"
            blank = " " * (len(variable) + 15)
            for row in rows[1:]:
                yield f"{blank}{row}{note if row is rows[-1] else ''}"
    same = len(back) == len(got) and all(
        np.shape(b) == np.shape(g) and np.allclose(b, g, rtol=1e-6, atol=1e-9 * np.abs(g).max(initial=0.0))
        for b, g in zip(back, got, strict=True)
    )
    if not same:
        yield ""
        yield "Plain Python comes to another result from the same lines than Taichi does. Most often a variable was"
        yield "born as a whole number (x = 0, ti.Vector([0, 0, 1])) and so cuts off what it is given later: write 0.0."


def _recognised(value: np.ndarray, way: Values) -> list[str]:
    """Which known quantities a value is: themselves, negated or transposed; none if it says nothing."""
    size = np.abs(value).max(initial=0.0)
    if size == 0 or (np.ndim(value) == 0 and float(value) in (1.0, 2.0, -1.0, 0.5)):
        return []
    changes = (("", lambda a: a), ("minus ", lambda a: -a), ("the transpose of ", np.transpose))
    return [
        words + label
        for words, change in changes
        for label, other in way.items()
        if np.shape(candidate := change(np.asarray(other))) == np.shape(value)
        and np.allclose(candidate, value, rtol=1e-9, atol=1e-12 * size)
    ]


def _whole(functions: Any, assignment: str, name: str, case: int) -> Iterator[str]:
    """One triangle from its vertices to the force: every task up to this one, yours and expected."""
    from muslin import reference
    from muslin.authoring.truth import truth
    from muslin.batch import evaluate

    order = [task for _, task, _ in CHAIN]
    if assignment != "cloth" or name not in order:
        return
    a, _ = reference.cases(assignment, "deformation_gradient")
    b, _ = reference.cases(assignment, "psi")
    case = min(case, len(a["N"]) - 1, len(b["mu"]) - 1)
    gradients = a["dphi_dX"][case]
    D = np.linalg.pinv(gradients[1:])
    known: dict[str, Any] = {"X0": np.zeros(3), "X1": D[:, 0], "X2": D[:, 1], "D": D}
    known |= {key: a[key][case] for key in ("x0", "x1", "x2", "N")}
    known |= {"mu": b["mu"][case], "lam": b["lam"][case], "h": 1.0}
    known["area"] = np.linalg.norm(np.cross(D[:, 0], D[:, 1])) / 2
    yield ""
    yield "One whole triangle, from its vertices on. Each function gets right inputs; what differs is its own."
    for symbol in ("D", "N"):
        yield from _titled("", {symbol: known[symbol]})
    for symbol, task, arguments in CHAIN[: order.index(name) + 1]:
        if symbol == "C" and "s" not in known:
            from muslin import given

            U, s, V = (part[0] for part in evaluate(given.svd, F=known["F"], N=known["N"]))
            known |= {"U": U, "s": s, "V": V}
            yield from _titled("", {"U (given svd)": U, "s": s, "V": V})
        values: dict[str, Any] = {key: np.asarray(known[what])[None] for key, what in arguments.items()}
        right = truth(task, values)[0][0]
        known[symbol] = right
        if symbol == "dphi_dX":
            known["grad_phi_0"] = right[0]
        try:
            mine = evaluate(functions[task], **values)
        except MuslinError:
            yield from _titled("", {f"{symbol} (yours: not yet)": right})
            continue
        scale = np.abs(right).max(initial=0.0) or 1.0
        if np.shape(mine[0]) == np.shape(right) and np.abs(mine[0] - right).max(initial=0.0) <= 1e-8 * scale:
            yield from _titled("", {f"{symbol} (yours agrees)": right})
        else:
            yield from _beside(symbol, mine[0], right)


# --- words -------------------------------------------------------------------------------------------------


def _number(value: Any) -> str:
    return f"{value:.6g}" if np.asarray(value).dtype.kind == "f" else str(value)


def _rows(value: Any) -> list[str]:
    """A number, vector or matrix in lines, columns aligned."""
    array = np.asarray(value)
    if array.ndim == 0:
        return [_number(array[()])]
    rows = array.reshape(-1, array.shape[-1])
    texts = [[_number(entry) for entry in row] for row in rows]
    wide = max(len(text) for row in texts for text in row)
    return ["[" + "  ".join(text.rjust(wide) for text in row) + "]" for row in texts]


def _titled(title: str, values: Values) -> Iterator[str]:
    if title and values:
        yield ""
        yield title
    for label, value in values.items():
        rows = _rows(value)
        yield f"  {label} = {rows[0]}"
        yield from (" " * (len(label) + 5) + row for row in rows[1:])


def _beside(label: str, mine: np.ndarray, right: np.ndarray) -> Iterator[str]:
    """Yours, expected and the difference, entry by entry."""
    columns = [_rows(mine), _rows(right), _rows(np.asarray(mine, float) - right)]
    heads = ("yours", "expected", "difference")
    wide = [max(len(head), *map(len, rows)) for head, rows in zip(heads, columns, strict=True)]
    yield f"  {label}"
    yield "    " + "   ".join(head.ljust(w) for head, w in zip(heads, wide, strict=True)).rstrip()
    for row in zip(*columns, strict=True):
        yield "    " + "   ".join(text.ljust(w) for text, w in zip(row, wide, strict=True)).rstrip()
