"""Elements of hinges: the two models of bending, and what a body needs of either.

With k the flexural rigidity [N m] and w, c, |e|, theta those of `muslin.physics.bending.Hinges`:

- `QuadraticHinges` (Bergou et al. 2006): k/2 w |sum_i c_i x_i|^2. It is quadratic, so its Hessian is constant. It takes
  every sheet for flat at rest, and lengths for constant, which they nearly are.
- `ShellHinges` (Grinspun et al. 2003): k/2 w |e|^2 (theta - theta_0)^2, with the angles theta_0 of the undeformed mesh.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import scipy.sparse as sp

from muslin.base import runtime
from muslin.base.launch import Launch, is_small, once
from muslin.physics.bending import Hinges
from muslin.physics.elements.bending_kernels import across, constant, quadratic, shells
from muslin.physics.elements.element import Element
from muslin.physics.elements.layout import grouped
from muslin.physics.elements.pattern import Gather, Pattern


class QuadraticHinges(Element):
    """The quadratic model.

    Its Hessian is constant: `factors` c (h, 4) and k w (h,) say that of the identity there is k w c_i c_j for each pair
    of a hinge's corners.
    """

    def __init__(self, X: np.ndarray, hinges: Hinges, stiffness: float):
        super().__init__(X, hinges.cells, (0, 3, 3))
        c, weight = np.ascontiguousarray(hinges.cotangents), stiffness * hinges.weight
        self.factors: tuple[np.ndarray, np.ndarray] | None = c, weight
        out = (self.energies, self.gradients)
        self._launch = Launch(quadratic(is_small(len(c), 40)), *self.at, c, weight, *out)

    def _run(self, parts: int, project: bool) -> None:
        if parts & 3:
            self._launch()
            self._done |= 3


class ShellHinges(Element):
    """Discrete shells, with rest angles."""

    factors: tuple[np.ndarray, np.ndarray] | None = None

    def __init__(self, X: np.ndarray, hinges: Hinges, stiffness: float):
        h = len(hinges.cells)
        super().__init__(X, hinges.cells, (16 * h, 3, 3))
        self._orders = np.zeros(2, dtype=np.int32)
        at_rest = (np.ascontiguousarray(hinges.angle), stiffness * hinges.weight * hinges.length**2)
        out = (self.energies, self.gradients, self.hessians)
        self._launch = Launch(shells(is_small(h, 400)), self._orders, *self.at, *at_rest, *out)

    def _run(self, parts: int, project: bool) -> None:
        self._orders[:] = parts, project
        self._launch()


#: Elements by the name of their model.
ELEMENTS: Mapping[str, type[QuadraticHinges] | type[ShellHinges]] = {
    "quadratic": QuadraticHinges,
    "shells": ShellHinges,
}


class Bending:
    """What hinges add to a body.

    Parameters
    ----------
    X : (n, 3)
        Undeformed positions [m].
    hinges : Hinges
    model : str
        A name in `ELEMENTS`.
    stiffness : float
        Flexural rigidity [N m].
    exact : bool
        Whether the matrix of a step is to be exact. The two vertices across an edge act on each other, but are no
        neighbours in the mesh: factors of a matrix that says so cost three times as much. Without, the quadratic model
        keeps to the mesh's pattern: what lies outside it, K_23 (v_3 - v_2), is taken at the velocities before the step
        and K_23 (v_2 - v_3) in the step itself is added, so that only its change is missing. Forces stay exact, and
        so do momentum, what rests, and what moves without accelerating.

    Attributes
    ----------
    widened : (h, 4) int32 or None
        Cells whose corners must be neighbours in the body's pattern.
    """

    def __init__(self, X: np.ndarray, hinges: Hinges, model: str, stiffness: float, exact: bool = True):
        self.element: QuadraticHinges | ShellHinges = ELEMENTS[model](X, hinges, stiffness)
        self._gather = Gather(hinges.cells, len(X))
        self.widened = hinges.cells if exact or self.element.factors is None else None
        self._outside: sp.csr_matrix | None = None
        if self.widened is None:
            assert self.element.factors is not None
            self._outside = _outside(hinges.cells, *self.element.factors, self._gather)

    def energy(self) -> float:
        """[J], at the positions taken."""
        self.element.compute("energy")
        return float(self.element.energies.sum())

    def gradient(self) -> np.ndarray:
        """(n, 3) [N], at the positions taken."""
        self.element.compute("gradient")
        return self._gather.vector(self.element.gradients)

    def factors(self, pattern: Pattern) -> np.ndarray | None:
        """Factor of the identity in each block of a pattern [N/m], where the Hessian is constant; else None."""
        if self.element.factors is None:
            return None
        cells, (c, weight) = self.element.cells, self.element.factors
        narrow = self._outside is not None  # 2 and 3 are no neighbours
        if runtime.plain():
            own, found, place = np.zeros(pattern.n), np.zeros(len(pattern.row)), pattern.ptr.copy()
            once(constant, int(narrow), cells, c, weight, pattern.ptr, pattern.col, place, own, found)
            return found
        between = weight[:, None, None] * c[:, :, None] * c[:, None, :]
        corners = between[:, range(4), range(4)]
        one, two = np.triu_indices(4, 1)
        if narrow:
            corners[:, 2:] += between[:, 2, 3, None]
            one, two = one[:-1], two[:-1]
        where = pattern.find(cells[:, one].ravel(), cells[:, two].ravel())
        own, found = np.zeros(pattern.n), np.zeros(len(pattern.row))
        found += np.bincount(where, between[:, one, two].ravel(), len(found))
        own += np.bincount(cells.ravel(), corners.ravel(), len(own))
        found += found.take(pattern.mirrored)
        found[pattern.row == pattern.col] = own
        return found

    def beyond(self, v: np.ndarray) -> np.ndarray | None:
        """What is too much in the pattern's matrix, times v: (n, 3), or None if nothing is."""
        return None if self._outside is None else self._outside @ v

    def excess(self) -> sp.csr_matrix | None:
        """What is too much in the pattern's matrix, (3n, 3n) [N/m], or None if nothing is."""
        return None if self._outside is None else sp.kron(self._outside, sp.identity(3), format="csr")


def _outside(cells: np.ndarray, c: np.ndarray, weight: np.ndarray, gather: Gather) -> sp.csr_matrix:
    """What of hinges (h, 4) is between the two vertices across an edge, (n, n) [N/m]: K_23 at both, -K_23 between."""
    n = gather.n
    if runtime.plain():
        ptr, columns = np.empty(n + 1, np.int32), np.empty(cells.size, np.int32)
        entries = np.empty(cells.size)
        once(across, cells, c, weight, gather.vertex_ptr, gather.vertex_rows, ptr, columns, entries)
        found = sp.csr_matrix((entries, columns, ptr), shape=(n, n))
    else:
        two, three = np.ascontiguousarray(cells[:, 2:].T)
        pull = weight * c[:, 2] * c[:, 3]
        rows, columns = np.concatenate([two, three, two, three]), np.concatenate([two, three, three, two])
        order, ptr = grouped(rows, n)
        entries = np.concatenate([pull, pull, -pull, -pull])
        found = sp.csr_matrix((entries.take(order), columns.take(order), ptr), shape=(n, n))
    found.sum_duplicates()
    return found
