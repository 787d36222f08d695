"""All functions of a submission together, on a small cloth.

`measure` runs in the worker: it simulates a scene with the submission's functions, the framework's own element
standing in where the grader says so. `judge` runs in the grader: the run is held against a run of the reference
that was made beforehand, and the functions against the laws of mechanics (`laws`).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from muslin import paths
from muslin.errors import MuslinError
from muslin.grading import laws
from muslin.grading.laws import Ask, extent
from muslin.grading.record import FAILED, PASSED, SKIPPED, Check, Simulation
from muslin.tasks import Functions

SCENE = "drape"
#: A small cloth that falls onto a sphere; long enough to show folds, and for the first steps to be compared.
PARAMETERS: Mapping[str, Any] = {"resolution": 20, "dt": 1 / 120, "steps": 90}
#: Draping is chaotic: only so many steps are comparable.
COMPARED_STEPS = 30

#: Largest difference of the energies, relative to the largest of them.
ENERGY = 1e-6

FOLLOWS = "energies follow the reference"


def measure(functions: Functions, stand_ins: Sequence[str]) -> dict[str, np.ndarray]:
    """Run the scene with a submission's functions (in the worker).

    Parameters
    ----------
    functions : Functions
    stand_ins : sequence of str
        Tasks whose functions must not be called.

    Returns
    -------
    dict of ndarray
        energies (steps + 1, 4): time, kinetic, elastic, gravity; positions (n, 3) at the end.
    """
    from muslin.simulation import simulate

    return _table(simulate(SCENE, functions=functions, stand_ins=stand_ins, **PARAMETERS))


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


def obeyed(ask: Ask, usable: frozenset[str]) -> tuple[Check, ...]:
    """Hold the functions against the laws of mechanics.

    Parameters
    ----------
    ask : Ask
        Gives the results of a function; raises `Trouble` where it cannot.
    usable : frozenset of str
        Tasks whose functions passed their own checks.
    """
    cloth = laws.Cloth(ask)
    return tuple(_law(name, cloth, usable) for name in laws.NEEDED)


def judge(
    laws_checked: tuple[Check, ...],
    run: Mapping[str, np.ndarray],
    trouble: str,
    expected: Mapping[str, np.ndarray],
    usable: frozenset[str],
    stand_ins: tuple[str, ...],
) -> Simulation:
    """Hold a run of the functions against the reference.

    Parameters
    ----------
    laws_checked : tuple of Check
        From `obeyed`.
    run : dict of ndarray
        What `measure` returned; empty where there was `trouble`, a sentence.
    expected : dict of ndarray
        From `reference`.
    usable : frozenset of str
        Tasks whose functions took part.
    stand_ins : tuple of str
        The others.
    """
    if run and not all(np.isfinite(table).all() for table in run.values()):
        run, trouble = {}, "The simulation left numbers that are not finite."
    if run:
        rows = COMPARED_STEPS + 1
        follows = _judged(FOLLOWS, *compare_energies(run["energies"][:rows], expected["energies"][:rows]))
    else:
        follows = Check(FOLLOWS, "simulation", FAILED, trouble)
    checks = (*laws_checked, follows)
    failed = any(check.status == FAILED for check in checks)
    told = "Your functions do not fit together" if failed else "Your functions work together"
    return Simulation(
        status=FAILED if failed else PASSED,
        message=f"{told}.",
        checks=checks,
        uses=tuple(sorted(usable)),
        stand_ins=stand_ins,
        scene=SCENE,
        energies=_rows(run["energies"]) if run else (),
        reference_energies=_rows(expected["energies"]),
        triangles=tuple(tuple(int(k) for k in t) for t in expected["triangles"]),
        positions=_rows(run["positions"]) if run else (),
        reference_positions=_rows(expected["positions"]),
    )


def forms(expected: Mapping[str, np.ndarray]) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each array that `measure` leaves, from a `reference` run."""
    return {name: ("<f8", expected[name].shape) for name in ("energies", "positions")}


class Trouble(Exception):
    """A function that was right by itself gave no results here; the sentence says why."""


def _law(name: str, cloth: laws.Cloth, usable: frozenset[str]) -> Check:
    absent = [need for need in dict.fromkeys(laws.NEEDED[name]) if need not in usable]
    if absent:
        return Check(name, "simulation", SKIPPED, f"skipped: it needs {', '.join(absent)}.")
    try:
        with np.errstate(all="ignore"):
            return _judged(name, *laws.error(name, cloth))
    except Trouble as trouble:
        return Check(name, "simulation", FAILED, str(trouble))
    except MuslinError:  # the grading itself cannot be done
        raise
    except Exception:
        return Check(name, "simulation", FAILED, "The results are not finite, or too large to compute with.")


def _judged(name: str, error: float, tolerance: float) -> Check:
    if error <= tolerance:
        return Check(name, "simulation", PASSED, "holds.")
    return Check(name, "simulation", FAILED, f"does not hold{extent(error)}.")


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
