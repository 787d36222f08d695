"""The run of a submission's functions together, made in a worker; nothing of what judges it is imported here."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.tasks import Functions


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
    from muslin.simulation.simulating import simulate

    made = functions.assignment.simulation
    assert made is not None
    return table_of(simulate(made.scene, functions=functions, stand_ins=stand_ins, **made.parameters))


def table_of(run: Any) -> dict[str, np.ndarray]:
    """What is told of a run: its energies, and the positions at its end."""
    columns = [run.energies[name] for name in ("time", "kinetic", "elastic", "gravity")]
    return {"energies": np.stack(columns, axis=1).astype(np.float64), "positions": run.x}
