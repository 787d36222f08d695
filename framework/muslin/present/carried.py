"""An adaptive cloth on one mesh that stays: for programs whose animations keep their triangles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from muslin.mesh import Mesh, Refinement
from muslin.mesh.surface import frozen
from muslin.physics.skinning import Skin, bind
from muslin.simulation.runs import RunFolder


class Carried(Sequence[np.ndarray]):
    """Frames of an adaptive cloth on its first mesh, refined everywhere as far as the run may refine it.

    Parameters
    ----------
    run : RunFolder

    Attributes
    ----------
    mesh : Mesh
        Undeformed.
    """

    def __init__(self, run: RunFolder):
        self._run = run
        begun = Mesh(run.X, run.triangles, run.scene.name)
        fine = Refinement.of(begun)
        for _ in range(run.scene.levels):
            fine = fine.refine(np.arange(len(fine.triangles)))
        self.mesh = frozen(fine.spread(run.X), fine.triangles, run.scene.name)
        self._skin: tuple[np.ndarray, Skin] | None = None

    def __len__(self) -> int:
        return len(self._run.frames)

    def __getitem__(self, k: Any) -> Any:
        if isinstance(k, slice):
            return [self[j] for j in range(*k.indices(len(self)))]
        rest, triangles = self._run.mesh_of(k)
        if self._skin is None or not np.array_equal(self._skin[0], triangles):
            self._skin = triangles, bind(self.mesh, frozen(rest, triangles, "adaptive"))
        return self._skin[1].carry(self._run.frames[k])
