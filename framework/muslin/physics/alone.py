"""One triangle or tetrahedron on its own: what is known of it, under the names that task tables use.

What a page shows that lets somebody pull at a single cell (`muslin.viewer.play`): quantities to call a folder's
functions with, the same quantities as the framework itself has them, and the cell that a reference case is about.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from muslin import given
from muslin.mesh import TetMesh
from muslin.physics import cloth, solid
from muslin.physics.body import Body
from muslin.physics.cloth import Cloth
from muslin.physics.solid import Solid, constants
from muslin.tasks import Functions
from muslin.tasks.batch import evaluate

Values = Mapping[str, np.ndarray]


#: What the framework knows of a cell: symbol -> unit and meaning.
QUANTITIES = {
    "F": ("1", "deformation gradient"),
    "s": ("1", "principal stretches"),
    "psi": ("J/m^3", "strain-energy density"),
    "P": ("Pa", "stress dpsi/dF"),
    "f": ("N", "force on each corner"),
}


@dataclass(frozen=True)
class Alone(ABC):
    """A cell of k corners.

    Attributes
    ----------
    X : (k, 3) array
        Undeformed corners [m].
    mu, lam : float
        Lamé parameters [Pa].
    energy : str
        Of a triangle, see `muslin.physics.cloth.Cloth`.
    """

    X: np.ndarray
    mu: float = 1.0
    lam: float = 1.0
    energy: str = ""

    @abstractmethod
    def body(
        self, functions: Functions | None = None, stand_ins: Iterable[str] = (), road: str = "closed"
    ) -> Body:
        """The cell as a body, with a folder's functions or the framework's own."""

    @abstractmethod
    def known(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """What a task may be called with at positions x (k, 3), by name: one row each."""

    def following(self, name: str, value: np.ndarray) -> dict[str, np.ndarray]:
        """What the result of a task makes known besides, by name: one row, or one for each corner."""
        return {"grad_phi": value[0]} if name == "dphi_dX" else {}

    @property
    def rest(self) -> np.ndarray:
        """Undeformed edges from corner 0 as columns, and the normal where a cell has one, (3, 3) [m]."""
        return self._frame(self.X)

    @property
    @abstractmethod
    def size(self) -> float:
        """What psi is multiplied with, the volume h a or V [m^3]."""

    def framework(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """F, s, psi, P and the forces f, as the framework has them: from edges, and from the energy's derivatives."""
        body = self.body()
        forces = -body.gradient(x)
        edges = self.X[1:] - self.X[0]
        F = np.linalg.solve(self.rest.T, self._frame(x).T).T
        return {
            "F": F,
            "s": self._stretches(F),
            "psi": np.asarray(body.energy(x) / self.size),
            "P": -forces[1:].T @ edges / self.size,
            "f": forces,
        }

    def scales(self) -> dict[str, float]:
        """How large quantities are that are not tiny, by name; of others it is 1."""
        length = float(np.linalg.norm(self.rest[:, 0]))
        return {"psi": self.mu, "P": self.mu, "f": self.mu * self.size / length}

    def directions(self, x: np.ndarray) -> np.ndarray:
        """Principal directions in the world times their stretches, one a row: (2 or 3, 3) [1]."""
        F = np.linalg.solve(self.rest.T, self._frame(x).T).T
        if len(self.X) == 3:
            n = self.rest[:, 2]
            F = F - np.outer(F @ n, n)
        U, s, _ = np.linalg.svd(F)
        return (U * s).T[: len(self.X) - 1]

    def at_stretches(self, s: np.ndarray) -> np.ndarray:
        """Corners (k, 3) where the cell has these principal stretches, along axes of its own."""
        axes, _ = np.linalg.qr(self.rest)
        F = axes @ np.diag(np.asarray(s, float)) @ axes.T
        return self.X @ F.T

    def case(self, inputs: Values) -> tuple[Alone, np.ndarray] | None:
        """The cell and the positions that a case of a task is about, from its inputs; None if it is about none."""
        k = len(self.X)
        rest = self
        if all(f"X{i}" in inputs for i in range(k)):
            rest = replace(self, X=np.stack([inputs[f"X{i}"] for i in range(k)]))
        elif "dphi_dX" in inputs:
            edges = np.linalg.pinv(inputs["dphi_dX"][1:]).T
            rest = replace(self, X=np.vstack([np.zeros(3), edges]))
        rest = rest._of_material(inputs)
        if all(f"x{i}" in inputs for i in range(k)):
            return rest, np.stack([inputs[f"x{i}"] for i in range(k)])
        if "F" in inputs:
            return rest, rest.X @ inputs["F"].T
        if "s" in inputs:
            return rest, rest.at_stretches(inputs["s"])
        return None if rest.X is self.X else (rest, rest.X)

    def _of_material(self, inputs: Values) -> Alone:
        mu, lam = (float(inputs.get(name, own)) for name, own in (("mu", self.mu), ("lam", self.lam)))
        return replace(self, mu=mu, lam=lam)

    @abstractmethod
    def _frame(self, x: np.ndarray) -> np.ndarray: ...

    @abstractmethod
    def _stretches(self, F: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class Triangle(Alone):
    """A triangle of cloth, one metre thick unless said otherwise."""

    h: float = 1.0

    def body(
        self, functions: Functions | None = None, stand_ins: Iterable[str] = (), road: str = "closed"
    ) -> Body:
        """The triangle as a cloth."""
        corners = np.array([[0, 1, 2]])
        made_of: dict[str, Any] = {"mu": self.mu, "lam": self.lam, "h": self.h, "energy": self.energy}
        return Cloth((self.X, corners), functions=functions, hessian=road, stand_ins=stand_ins, **made_of)

    def known(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Corners, a point in the middle, the normal, area, thickness and material."""
        corners = {f"{name}{k}": at[k] for name, at in (("X", self.X), ("x", x)) for k in range(3)}
        area = self.size / self.h
        made_of = {"N": self.rest[:, 2], "area": area, "h": self.h, "mu": self.mu, "lam": self.lam}
        return _rows({**corners, "X": self.X.mean(axis=0), **made_of})

    def following(self, name: str, value: np.ndarray) -> dict[str, np.ndarray]:
        """Gradients one by one; of F its singular value decomposition, as the given code has it."""
        if name != "F":
            return super().following(name, value)
        U, s, V = evaluate(given.svd, F=value, N=self.rest[:, 2])
        return {"U": U, "s": s, "V": V}

    @property
    def size(self) -> float:
        """Thickness times area, h a [m^3]."""
        return self.h * float(np.linalg.norm(np.cross(self.X[1] - self.X[0], self.X[2] - self.X[0]))) / 2

    def _frame(self, x: np.ndarray) -> np.ndarray:
        a, b = x[1] - x[0], x[2] - x[0]
        n = np.cross(a, b)
        return np.stack([a, b, n / max(float(np.linalg.norm(n)), 1e-300)], axis=1)

    def _stretches(self, F: np.ndarray) -> np.ndarray:
        n = self.rest[:, 2]
        in_plane = np.linalg.svd(F - np.outer(F @ n, n), compute_uv=False)[:2]
        return np.append(in_plane, 1.0)


@dataclass(frozen=True)
class Tetrahedron(Alone):
    """A tetrahedron of a solid."""

    def body(
        self, functions: Functions | None = None, stand_ins: Iterable[str] = (), road: str = "closed"
    ) -> Body:
        """The tetrahedron as a solid."""
        C, D = constants(self.mu, self.lam)
        mesh = TetMesh.from_arrays(self.X, np.array([[0, 1, 2, 3]]))
        return Solid(mesh, C=C, D=D, functions=functions, stand_ins=stand_ins)

    def known(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """Corners, a point in the middle, volume and material."""
        corners = {f"{name}{k}": at[k] for name, at in (("X", self.X), ("x", x)) for k in range(4)}
        C, D = constants(self.mu, self.lam)
        return _rows({**corners, "X": self.X.mean(axis=0), "volume": self.size, "C": C, "D": D})

    @property
    def size(self) -> float:
        """V [m^3]."""
        return float(np.linalg.det(self.rest)) / 6

    def _of_material(self, inputs: Values) -> Alone:
        if not {"C", "D"} <= inputs.keys():
            return self
        mu = 2 * float(inputs["C"])
        return replace(self, mu=mu, lam=2 * float(inputs["D"]) - 2 / 3 * mu)

    def _frame(self, x: np.ndarray) -> np.ndarray:
        return np.stack([x[k] - x[0] for k in (1, 2, 3)], axis=1)

    def _stretches(self, F: np.ndarray) -> np.ndarray:
        return np.linalg.svd(F, compute_uv=False)


def _rows(values: Mapping[str, Any]) -> dict[str, np.ndarray]:
    return {name: np.asarray(value, dtype=np.float64)[None] for name, value in values.items()}


def triangle(mu: float = 1.0, lam: float = 1.0) -> Triangle:
    """An equilateral triangle with edges of a metre, its middle in the origin, upright."""
    angle = np.pi / 2 + np.arange(3) * 2 * np.pi / 3
    X = np.stack([np.cos(angle), np.sin(angle), np.zeros(3)], axis=1) / np.sqrt(3)
    return Triangle(X, mu, lam)


def tetrahedron(mu: float = 1.0, lam: float = 1.0) -> Tetrahedron:
    """A regular tetrahedron with edges of a metre, its middle in the origin."""
    X = np.array([[1, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]], dtype=float) / np.sqrt(8)
    made = Tetrahedron(X, mu, lam)
    return made if made.size > 0 else replace(made, X=X[[0, 2, 1, 3]])


#: What can be played with, by name, and the tasks its body calls.
CELLS = {"triangle": (triangle, cloth.NEEDS), "tetrahedron": (tetrahedron, solid.NEEDS)}


def of_assignment(tasks: Iterable[str]) -> str:
    """Which of `CELLS` an assignment with these tasks is about."""
    there = set(tasks)
    missing = {
        name: {n for names in needs.values() for n in names} - there for name, (_, needs) in CELLS.items()
    }
    return min(missing, key=lambda name: len(missing[name]))
