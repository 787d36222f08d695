"""The run of a submission's functions together, made in a worker; nothing of what judges it is imported here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.tasks import Functions

#: What is told of each step, by table: columns of a run's log.
COLUMNS = {
    "energies": ("time", "kinetic", "elastic", "gravity"),
    "momenta": ("px", "py", "pz", "lx", "ly", "lz"),
}


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
        energies (steps + 1, 4): time, kinetic, elastic, gravity; momenta (steps + 1, 6): linear and, about the
        centre of mass, angular; positions (n, 3) at the end.
    """
    from muslin.simulation.simulating import simulate

    made = functions.assignment.simulation
    assert made is not None
    return table_of(simulate(made.scene, functions=functions, stand_ins=stand_ins, **made.parameters))


def table_of(run: Any) -> dict[str, np.ndarray]:
    """What is told of a run: its energies and momenta, and the positions at its end."""
    told = {name: [run.energies[column] for column in columns] for name, columns in COLUMNS.items()}
    return {name: np.stack(table, axis=1).astype(np.float64) for name, table in told.items()} | {
        "positions": run.x
    }
