"""From forces to motion: a model, what moves it on, scenes, and runs on disk.

`simulate` is imported on first use: a run on disk is read without loading what makes one.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from muslin.simulation.marching import Run
    from muslin.simulation.simulating import simulate

__all__ = ["Run", "simulate"]


def __getattr__(name: str) -> Any:
    if name in __all__:
        from muslin.simulation import simulating

        return getattr(simulating, name)
    raise AttributeError(f"module 'muslin.simulation' has no attribute {name!r}")
