"""All functions of a submission together, on a small cloth.

`measure` runs in the worker: it builds a cloth with the submission's functions, the framework's own element
standing in where the grader says so, and returns what it measures. `judge` runs in the grader and holds that
against the laws of mechanics and against a run of the reference that was made beforehand.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from muslin import paths
from muslin.errors import MuslinError
from muslin.grading.record import FAILED, PASSED, SKIPPED, Check, Simulation
from muslin.stand_ins import NEEDS
from muslin.tasks import Functions

SCENE = "drape"
#: A small cloth that falls onto a sphere; long enough to show folds, and for the first steps to be compared.
PARAMETERS: Mapping[str, Any] = {"resolution": 20, "dt": 1 / 120, "steps": 90}
#: Draping is chaotic: only so many steps are comparable.
COMPARED_STEPS = 30

MATERIAL: Mapping[str, Any] = {"mu": 2e3, "lam": 1.5e3, "rho": 0.2, "h": 1.0}
STEPS = 10.0 ** -np.arange(2.0, 7.0)

#: Largest errors, relative to the natural size of each.
BALANCE, SYMMETRY, SLOPE, ENERGY = 1e-9, 1e-6, 1e-6, 1e-6

#: What each check needs of the submission's own functions; it is skipped without them.
CHECKS: Mapping[str, tuple[str, ...]] = {
    "net force and torque are zero": NEEDS["gradient"],
    "force is minus the slope of the energy": (*NEEDS["energy"], *NEEDS["gradient"]),
    "Hessian is the slope of the force (closed form)": (*NEEDS["gradient"], *NEEDS["hessian"]),
    "Hessian is the slope of the force (lecture's road)": (*NEEDS["gradient"], *NEEDS["lecture's hessian"]),
    "translations meet no resistance": NEEDS["hessian"],
    "mass adds up to density times area": NEEDS["mass"],
    "kinetic energy agrees with the mass": (*NEEDS["mass"], *NEEDS["kinetic energy"]),
    "squares of the stretches are eigenvalues of C": (
        "deformation_gradient",
        "dphi_dX",
        "right_cauchy_green",
    ),
    "a finer mesh follows the cloth": (*NEEDS["binding"], *NEEDS["carrying"]),
    "energies follow the reference": (),
}


def test_cloth() -> dict[str, np.ndarray]:
    """A small irregular cloth and a deformed state of it, the same every time.

    Returns
    -------
    dict of ndarray
        X (n, 3), triangles (m, 3), x (n, 3) deformed, d (n, 3) a direction to move in.
    """
    side = 5
    u, v = (a.ravel() for a in np.meshgrid(np.linspace(0, 1, side), np.linspace(0, 1, side), indexing="ij"))
    k = np.arange(side * side)
    u, v = u + 0.04 * np.sin(7.0 * k + 1), v + 0.04 * np.cos(5.0 * k)
    X = np.stack([u, v, 0.05 * np.sin(3.0 * u + 2.0 * v)], axis=1)
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    a, b, c, e = corner, corner + side, corner + side + 1, corner + 1
    triangles = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, e], axis=1)]).astype(np.int32)
    bend = np.stack([1.15 * u, 0.9 * v + 0.2 * u, 0.25 * np.sin(4.0 * u) * np.cos(3.0 * v)], axis=1)
    d = np.stack([np.sin(9.0 * k), np.cos(11.0 * k + 1), np.sin(13.0 * k + 2)], axis=1)
    return {"X": X, "triangles": triangles, "x": bend, "d": d}


def measure(
    functions: Functions, request: Mapping[str, Any], arrays: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    """Measure a submission (in the worker): "laws" on the test cloth, or a "run" of the scene.

    Parameters
    ----------
    functions : Functions
    request : dict
        what: "laws" or "run"; stand_ins: tasks whose functions must not be called.
    arrays : dict of ndarray
        The test cloth.

    Returns
    -------
    dict of ndarray
    """
    stand_ins = request["stand_ins"]
    return _run(functions, stand_ins) if request["what"] == "run" else _laws(functions, stand_ins, arrays)


def _laws(
    functions: Functions, stand_ins: list[str], arrays: Mapping[str, np.ndarray]
) -> dict[str, np.ndarray]:
    from muslin.batch import evaluate
    from muslin.cloth import Cloth
    from muslin.mesh import Mesh
    from muslin.skinning import bind

    X, triangles, x, d = (arrays[name] for name in ("X", "triangles", "x", "d"))
    mine = {name for name in functions.assignment.tasks if name not in stand_ins}

    def cloth(road: str) -> Cloth:
        return Cloth((X, triangles), functions=functions, hessian=road, stand_ins=stand_ins, **MATERIAL)

    closed = cloth("closed")
    at = [x + sign * step * d for step in STEPS for sign in (1, -1)]
    measured = {
        "energies": np.array([closed.energy(state) for state in at]),
        "gradients": np.array([closed.gradient(state) for state in at]),
        "gradient": closed.gradient(x),
        "closed": closed.hessian(x).toarray(),
        "mass": closed.mass @ np.ones(3 * len(X)),
        "kinetic": np.array([closed.kinetic_energy(d), 0.5 * d.ravel() @ (closed.mass @ d.ravel())]),
    }
    if mine.issuperset(NEEDS["lecture's hessian"]):
        measured["lecture"] = cloth("lecture").hessian(x).toarray()
    if mine.issuperset(CHECKS["squares of the stretches are eigenvalues of C"]):
        dphi = evaluate(functions.dphi_dX, **{f"X{k}": X[triangles[:, k]] for k in range(3)})
        corners = {f"x{k}": x[triangles[:, k]] for k in range(3)}
        F = evaluate(functions.deformation_gradient, **corners, dphi_dX=dphi, N=closed.normal)
        measured["C"] = evaluate(functions.right_cauchy_green, F=F)
    if mine.issuperset(CHECKS["a finer mesh follows the cloth"]):
        fine = (X[triangles[:, 0]] + X[triangles[:, 1]] + 2 * X[triangles[:, 2]]) / 4
        count = len(fine) - len(fine) % 3
        mesh = Mesh(fine[:count], np.arange(count, dtype=np.int32).reshape(-1, 3))
        measured["carried"] = bind(mesh, closed.mesh, functions, stand_ins).carry(x)
    return measured


def _run(functions: Functions, stand_ins: list[str]) -> dict[str, np.ndarray]:
    from muslin.simulation import simulate

    run = simulate(SCENE, functions=functions, stand_ins=stand_ins, **PARAMETERS)
    return _table(run)


def _table(run: Any) -> dict[str, np.ndarray]:
    columns = [run.energies[name] for name in ("time", "kinetic", "elastic", "gravity")]
    return {"energies": np.stack(columns, axis=1).astype(np.float64), "positions": run.x}


# the reference ----------------------------------------------------------------------------------------------


def make_reference() -> dict[str, np.ndarray]:
    """Run the scene with the framework's own element: what `reference build` writes."""
    from muslin.simulation import simulate

    run = simulate(SCENE, **PARAMETERS)
    return {**_table(run), "triangles": np.asarray(run.mesh.triangles, dtype=np.int32)}


def reference(assignment: str) -> dict[str, np.ndarray] | None:
    """The reference run that ships with an assignment's data, or None if it has no simulation.

    Raises
    ------
    MuslinError
        If the file is damaged.
    """
    path = paths.reference(assignment) / "simulation" / f"{SCENE}.npz"
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in ("energies", "positions", "triangles")}
    except (OSError, ValueError, KeyError) as error:
        raise MuslinError(f"{paths.shown(path)} is damaged ({error}).", "Restore it.") from None


# the verdict ------------------------------------------------------------------------------------------------


def judge(
    laws: Mapping[str, np.ndarray], run: Mapping[str, np.ndarray], expected: Mapping[str, np.ndarray],
    usable: frozenset[str], stand_ins: tuple[str, ...], troubles: Mapping[str, str],
) -> Simulation:  # fmt: skip
    """Hold the measurements against the laws of mechanics and the reference run.

    Parameters
    ----------
    laws, run : dict of ndarray
        What `measure` returned for each; empty where it could not.
    expected : dict of ndarray
        From `reference`.
    usable : frozenset of str
        Tasks whose functions passed their own checks.
    stand_ins : tuple of str
        The others.
    troubles : dict
        What went wrong on the way: "laws", "run" -> sentence.

    Returns
    -------
    Simulation
    """
    given = test_cloth()
    steps, rows = PARAMETERS["steps"], COMPARED_STEPS + 1
    shapes = {"energies": (steps + 1, 4), "positions": expected["positions"].shape}
    if run and any(
        k not in run or run[k].shape != s or not np.isfinite(run[k]).all() for k, s in shapes.items()
    ):
        run, troubles = {}, {**troubles, "run": "The simulation left numbers that are not finite."}
    checks = []
    for name, needs in CHECKS.items():
        if not usable.issuperset(needs):
            absent = ", ".join(dict.fromkeys(need for need in needs if need not in usable))
            checks.append(Check(name, "simulation", SKIPPED, f"skipped: it needs {absent}."))
            continue
        is_run = name == "energies follow the reference"
        if not (run if is_run else laws):
            message = troubles.get("run" if is_run else "laws", "It could not be measured.")
            checks.append(Check(name, "simulation", FAILED, message))
            continue
        try:
            if is_run:
                error, tolerance = compare_energies(run["energies"][:rows], expected["energies"][:rows])
            else:
                error, tolerance = _law(name, laws, given)
        except (KeyError, ValueError, IndexError, np.linalg.LinAlgError):
            error, tolerance = np.inf, 0.0
        if error <= tolerance:
            checks.append(Check(name, "simulation", PASSED, f"holds; relative error {error:.1e}."))
        else:
            size = f"{error:.1e}" if np.isfinite(error) else "infinite"
            checks.append(Check(name, "simulation", FAILED, f"does not hold: relative error {size}."))
    failed = [check.name for check in checks if check.status == FAILED]
    told = _told(failed, stand_ins)
    return Simulation(
        status=FAILED if failed else PASSED,
        message=told,
        checks=tuple(checks),
        uses=tuple(sorted(usable)),
        stand_ins=stand_ins,
        scene=SCENE,
        energies=_rows(run["energies"]) if run else (),
        reference_energies=_rows(expected["energies"]),
        triangles=tuple(tuple(int(k) for k in t) for t in expected["triangles"]),
        positions=_rows(run["positions"]) if run else (),
        reference_positions=_rows(expected["positions"]),
    )


def _told(failed: list[str], stand_ins: tuple[str, ...]) -> str:
    together = "Your functions do not fit together" if failed else "Your functions work together"
    if stand_ins:
        together += f"; Muslin's own element stood in for {', '.join(stand_ins)}"
    return together + "."


def _law(name: str, laws: Mapping[str, np.ndarray], given: Mapping[str, np.ndarray]) -> tuple[float, float]:
    """Relative error of one law, and how large it may be."""
    X, triangles, x, d = (given[key] for key in ("X", "triangles", "x", "d"))
    g = laws["gradient"]
    slope = np.array([forward - back for forward, back in laws["energies"].reshape(-1, 2)]) / (2 * STEPS)
    bend = laws["gradients"].reshape(len(STEPS), 2, *x.shape)
    if name == "net force and torque are zero":
        size = np.abs(g).sum()
        about = x - x.mean(axis=0)
        return float(
            max(np.abs(g.sum(axis=0)).max(), np.abs(np.cross(about, g).sum(axis=0)).max()) / size
        ), BALANCE
    if name == "force is minus the slope of the energy":
        return float(np.min(np.abs(slope - np.sum(g * d)) / np.abs(g * d).sum())), SLOPE
    if name.startswith("Hessian is the slope"):
        H = laws["closed" if "closed" in name else "lecture"]
        turn = (bend[:, 0] - bend[:, 1]).reshape(len(STEPS), -1) / (2 * STEPS[:, None])
        right = H @ d.ravel()
        error = float(np.min(np.linalg.norm(turn - right, axis=1)) / np.linalg.norm(right))
        return max(error, float(np.abs(H - H.T).max() / np.abs(H).max())), 1e-5
    if name == "translations meet no resistance":
        H = laws["closed"]
        moved = H.reshape(-1, len(x), 3).sum(axis=1)
        return float(np.abs(moved).max() / np.abs(H).max()), BALANCE
    if name == "mass adds up to density times area":
        corners = [X[triangles[:, k]] for k in range(3)]
        area = np.linalg.norm(np.cross(corners[1] - corners[0], corners[2] - corners[0]), axis=1).sum() / 2
        total = MATERIAL["rho"] * MATERIAL["h"] * area
        return float(abs(laws["mass"].sum() / 3 - total) / total), BALANCE
    if name == "kinetic energy agrees with the mass":
        T, from_mass = laws["kinetic"]
        return float(abs(T - from_mass) / abs(from_mass)), BALANCE
    if name == "squares of the stretches are eigenvalues of C":
        from muslin.mesh import principal_stretches

        expected = np.concatenate(
            [principal_stretches(X, x, triangles), np.ones((len(triangles), 1))], axis=1
        )
        found = np.linalg.eigvalsh((laws["C"] + laws["C"].transpose(0, 2, 1)) / 2)
        return float(np.abs(found - np.sort(expected**2, axis=1)).max()), BALANCE
    carried = laws["carried"]
    fine = (x[triangles[:, 0]] + x[triangles[:, 1]] + 2 * x[triangles[:, 2]]) / 4
    return float(np.abs(carried - fine[: len(carried)]).max()), BALANCE


def compare_energies(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Largest difference of two energy tables relative to the largest energy, and how large it may be."""
    size = np.abs(expected[:, 1:]).max()
    return float(np.abs(found - expected).max() / size), ENERGY


def _rows(table: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """Rows of a table, to seven digits: for pictures and plots."""
    return tuple(tuple(float(f"{value:.7g}") for value in row) for row in table)


def skipped(why: str) -> Simulation:
    """No simulation, and why."""
    return Simulation(SKIPPED, why)
