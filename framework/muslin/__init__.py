"""Muslin: learn cloth animation by filling in the finite-element functions of a working simulator.

The public face, kept stable::

    f = muslin.load("solutions/cloth")                      # the task functions of any folder
    P = muslin.evaluate(f.dpsi_dF, U=U, dpsi_ds=p, V=V)     # arrays (b, ...) in, array (b, ...) out
    cloth = muslin.Cloth(mesh, mu=..., lam=..., functions=f)
    run = muslin.simulate("course", functions=f, steps=300)
    record = muslin.grade("path/to/submission", assignment="cloth")

Everything is imported on first use, so that `import muslin` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from muslin import paths

__version__ = "0.1.0"

paths.find_caches()  # before anything can import the engine, which dies without a home

_HOMES = {
    "load": "muslin.tasks",
    "evaluate": "muslin.batch",
    "Mesh": "muslin.mesh",
    "TetMesh": "muslin.mesh",
    "Cloth": "muslin.cloth",
    "simulate": "muslin.simulation",
    "grade": "muslin.grading.grader",
    "MuslinError": "muslin.errors",
}

__all__ = ["Cloth", "Mesh", "MuslinError", "TetMesh", "evaluate", "grade", "load", "simulate"]

if TYPE_CHECKING:
    from muslin.batch import evaluate
    from muslin.cloth import Cloth
    from muslin.errors import MuslinError
    from muslin.grading.grader import grade
    from muslin.mesh import Mesh, TetMesh
    from muslin.simulation import simulate
    from muslin.tasks import load


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if not name.startswith("_"):
        try:
            return import_module(f"muslin.{name}")
        except ModuleNotFoundError as error:
            if error.name != f"muslin.{name}":
                raise
    raise AttributeError(f"module 'muslin' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted([*globals(), *_HOMES])


def load_ipython_extension(shell: Any) -> None:
    """Called by `%load_ext muslin` in a notebook."""
    from muslin.notebook.cells import register

    register(shell)
