"""Muslin: learn cloth animation by filling in the finite-element functions of a working simulator.

The public face, kept stable::

    f = muslin.load("solutions/cloth")                      # the task functions of any folder
    P = muslin.evaluate(f.dpsi_dF, U=U, dpsi_ds=p, V=V)     # arrays (b, ...) in, array (b, ...) out
    cloth = muslin.Cloth(mesh, mu=..., lam=..., functions=f)
    solid = muslin.Solid(mesh, C=..., D=..., functions=f)
    run = muslin.simulate("course", functions=f, steps=300)
    record = muslin.grade("path/to/submission", assignment="cloth")

Everything is imported on first use, so that `import muslin` costs nothing.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from muslin.base import moved, paths
from muslin.base.version import __version__ as __version__

paths.find_caches()  # before anything can import the engine, which dies without a home
moved.watch()

_HOMES = {
    "load": "muslin.tasks",
    "evaluate": "muslin.tasks.batch",
    "Mesh": "muslin.mesh",
    "TetMesh": "muslin.mesh",
    "Cloth": "muslin.physics.cloth",
    "Solid": "muslin.physics.solid",
    "simulate": "muslin.simulation.simulating",
    "grade": "muslin.grading.grader",
    "run_html": "muslin.notebook.shows",
    "MuslinError": "muslin.base.errors",
}

__all__ = [
    "Cloth", "Mesh", "MuslinError", "Solid", "TetMesh", "evaluate", "grade", "load", "simulate",
]  # fmt: skip

if TYPE_CHECKING:
    from muslin.base.errors import MuslinError
    from muslin.grading.grader import grade
    from muslin.mesh import Mesh, TetMesh
    from muslin.physics.cloth import Cloth
    from muslin.physics.solid import Solid
    from muslin.simulation.simulating import simulate
    from muslin.tasks import load
    from muslin.tasks.batch import evaluate


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
    return sorted({*globals(), *__all__})


def load_ipython_extension(shell: Any) -> None:
    """Called by `%load_ext muslin` in a notebook."""
    import_module("muslin.notebook.cells").register(shell)
