"""All functions of a submission together, on a small scene.

`muslin.grading.measuring` runs in the worker: it simulates a scene with the submission's functions, the framework's own
element standing in where the grader says so. `judge` runs in the grader: the run is held against a run of the reference
that was made beforehand, and the functions against the laws of mechanics (`laws`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading.laws import judged
from muslin.grading.measuring import table_of
from muslin.grading.record import FAILED, PASSED, SKIPPED, Check
from muslin.grading.record import Simulation as Together
from muslin.tasks.manifest import Simulation

#: Largest difference of the energies, relative to the largest of them.
ENERGY = 1e-6

FOLLOWS = "energies follow the reference"


# the reference ----------------------------------------------------------------------------------------------


def make_reference(made: Simulation) -> dict[str, np.ndarray]:
    """Run the scene with the framework's own element: what `reference build` writes."""
    from muslin.simulation.simulating import simulate

    run = simulate(made.scene, **made.parameters)
    return {**table_of(run), "triangles": np.asarray(run.mesh.triangles, dtype=np.int32)}


def reference(assignment: str) -> dict[str, np.ndarray] | None:
    """The reference run that ships with an assignment's data, or None if it has no simulation.

    Raises
    ------
    MuslinError
        If the file is damaged.
    """
    made = tasks.assignment(assignment).simulation
    if made is None:
        return None
    path = paths.reference(assignment) / "simulation" / f"{made.scene}.npz"
    if not path.is_file():
        return None
    try:
        with np.load(path, allow_pickle=False) as data:
            return {name: data[name] for name in ("energies", "momenta", "positions", "triangles")}
    except (OSError, ValueError, KeyError) as error:
        raise MuslinError(f"{paths.shown(path)} is damaged ({error}).", "Restore it.") from None


# the verdict ------------------------------------------------------------------------------------------------


def judge(
    made: Simulation | None,
    laws_checked: tuple[Check, ...],
    run: Mapping[str, np.ndarray],
    trouble: str,
    expected: Mapping[str, np.ndarray] | None,
    usable: frozenset[str],
    stand_ins: tuple[str, ...],
) -> Together:
    """Hold a run of the functions against the reference.

    Parameters
    ----------
    made : Simulation, optional
        What the manifest says of the run.
    laws_checked : tuple of Check
        From `muslin.grading.laws.obeyed`.
    run : dict of ndarray
        What `measure` returned; empty where there was `trouble`, a sentence.
    expected : dict of ndarray, optional
        From `reference`.
    usable : frozenset of str
        Tasks whose functions took part.
    stand_ins : tuple of str
        The others.
    """
    checks = laws_checked
    if made is not None and expected is not None:
        if run and not all(np.isfinite(table).all() for table in run.values()):
            run, trouble = {}, "The simulation left numbers that are not finite."
        follows = Check(FOLLOWS, "simulation", FAILED, trouble)
        if run:
            rows = made.compared_steps + 1
            follows = judged(FOLLOWS, *compare_energies(run["energies"][:rows], expected["energies"][:rows]))
        checks = (*laws_checked, follows)
    failed = any(check.status == FAILED for check in checks)
    told = "Your functions do not fit together" if failed else "Your functions work together"
    together = Together(
        status=FAILED if failed else PASSED,
        message=f"{told}.",
        checks=checks,
        uses=tuple(sorted(usable)),
        stand_ins=stand_ins,
    )
    if made is None or expected is None:
        return together
    return replace(
        together,
        scene=made.scene,
        energies=_rows(run["energies"]) if run else (),
        reference_energies=_rows(expected["energies"]),
        momenta=_rows(run["momenta"]) if run else (),
        reference_momenta=_rows(expected["momenta"]),
        triangles=tuple(tuple(int(k) for k in t) for t in expected["triangles"]),
        positions=_rows(run["positions"]) if run else (),
        reference_positions=_rows(expected["positions"]),
    )


def forms(expected: Mapping[str, np.ndarray]) -> dict[str, tuple[str, tuple[int, ...]]]:
    """Type and shape of each array that `measure` leaves, from a `reference` run."""
    return {name: ("<f8", expected[name].shape) for name in ("energies", "momenta", "positions")}


def compare_energies(found: np.ndarray, expected: np.ndarray) -> tuple[float, float]:
    """Largest difference of two energy tables relative to the largest energy, and how large it may be."""
    size = np.abs(expected[:, 1:]).max()
    return float(np.abs(found - expected).max() / size), ENERGY


def _rows(table: np.ndarray) -> tuple[tuple[float, ...], ...]:
    """Rows of a table, to seven digits: for pictures and plots."""
    return tuple(tuple(float(f"{value:.7g}") for value in row) for row in table)


def skipped(why: str) -> Together:
    """No simulation, and why."""
    return Together(SKIPPED, why)
