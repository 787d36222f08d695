"""The functions of a submission put together on a small solid, and the laws of mechanics they must obey then.

Runs in the grader. It asks for one function after the other, each on what the ones before it gave, and sums over
tetrahedra in plain numpy: nothing has to be compiled that is not compiled already, and no code is shared with the
simulator.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.judging import Ask, Law

MATERIAL: Mapping[str, float] = {"C": 1e3, "D": 2.5e3}
RHO = 900.0

#: A spring that pulls at the last vertex.
SPRING: Mapping[str, float] = {"l0": 0.3, "k": 700.0}

#: Steps of the differences that slopes are compared with [m].
STEPS = 10.0 ** -np.arange(2.0, 7.0)

#: Largest relative errors: of what cancels exactly, of a slope, of the slope of a slope.
BALANCE, SLOPE, CURVATURE = 1e-9, 1e-6, 1e-5

#: A cube in five tetrahedra, twice, one beside the other.
CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)])
FIVE = np.array([(0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 5, 6, 7), (0, 2, 7, 5)])


class Solid:
    """A small irregular solid, the same every time, as the functions of a submission see it.

    Everything is computed when it is first asked for, and what a function gives is asked for once.
    """

    def __init__(self, ask: Ask):
        self._ask, self._kept = ask, {}  # type: ignore[var-annotated]
        points = np.concatenate([CUBE, CUBE + np.array([1, 0, 0])]).astype(float)
        where, number = np.unique(points, axis=0, return_inverse=True)
        self.cells = np.concatenate([number.ravel()[FIVE], number.ravel()[8 + _mirrored(FIVE)]])
        k = np.arange(len(where))[:, None] + np.arange(3)
        self.X = where + 0.1 * np.sin(7.0 * k + 1)
        turn = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
        bend = np.stack(
            [0.2 * np.sin(2 * self.X[:, 1]), -0.15 * self.X[:, 0], 0.1 * self.X[:, 0] ** 2], axis=1
        )
        self.x = (1.1 * self.X + bend) @ turn.T + np.array([3.0, -2.0, 1.0])
        #: a direction to move in
        self.d = np.sin(
            np.array([9.0, 11.0, 13.0]) * np.arange(len(where))[:, None] + np.array([0.0, 1.0, 2.0])
        )
        corners = self.X[self.cells]
        self.volume = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6
        self.anchor = self.x[-1] + np.array([0.5, 0.7, -0.4])
        #: x itself, then x + t d and x - t d for every step t
        self.states = np.stack([self.x, *(self.x + sign * t * self.d for t in STEPS for sign in (1, -1))])

    def ask(self, task: str, **inputs: Any) -> Any:
        """What a function gives; the only result where it has one."""
        results = self._ask(task, {name: np.ascontiguousarray(value) for name, value in inputs.items()})
        return results[0] if len(results) == 1 else results

    def once(self, make: Callable[[], Any]) -> Any:
        """The value of a method without arguments, made once."""
        name = make.__name__
        if name not in self._kept:
            self._kept[name] = make()
        return self._kept[name]

    def gradients_of_phi(self) -> np.ndarray:
        corners = self.X[self.cells]
        return np.asarray(self.ask("dphi_dX", **{f"X{k}": corners[:, k] for k in range(4)}))

    def deformed(self) -> np.ndarray:
        """F of every tetrahedron in every state, (states * m, 3, 3)."""
        corners = self.states[:, self.cells].reshape(-1, 4, 3)
        dphi = np.tile(self.once(self.gradients_of_phi), (len(self.states), 1, 1))
        return np.asarray(
            self.ask("deformation_gradient", **{f"x{k}": corners[:, k] for k in range(4)}, dphi_dX=dphi)
        )

    def material(self, count: int) -> dict[str, np.ndarray]:
        return {name: np.full(count, value) for name, value in MATERIAL.items()}

    def energies(self) -> np.ndarray:
        """Potential energy of every state."""
        F = self.once(self.deformed)
        psi = self.ask("psi", F=F, **self.material(len(F))).reshape(len(self.states), -1)
        return np.asarray((self.volume * psi).sum(axis=1))

    def turned(self) -> tuple[np.ndarray, np.ndarray]:
        """The energy density of every tetrahedron as it is, and turned by a rotation."""
        F = self.once(self.deformed)[: len(self.cells)]
        R = np.array([[2.0, -1.0, 2.0], [2.0, 2.0, -1.0], [-1.0, 2.0, 2.0]]) / 3
        psi = self.ask("psi", F=np.concatenate([F, R @ F]), **self.material(2 * len(F)))
        return psi[: len(F)], psi[len(F) :]

    def slopes(self) -> np.ndarray:
        """Gradient of the potential energy in every state, (states, n, 3)."""
        F = self.once(self.deformed)
        P = self.ask("dpsi_dF", F=F, **self.material(len(F)))
        count = len(self.states)
        grad_phi = np.tile(self.once(self.gradients_of_phi).reshape(-1, 3), (count, 1))
        volume = np.tile(np.repeat(self.volume, 4), count)
        f = self.ask("nodal_force", P=np.repeat(P, 4, axis=0), grad_phi=grad_phi, volume=volume)
        total = np.zeros_like(self.states)
        for state, forces in zip(total, f.reshape(count, -1, 3), strict=True):
            np.add.at(state, self.cells.ravel(), -forces)
        return total

    def stiffness(self) -> np.ndarray:
        """Hessian of the potential energy at x, (3n, 3n)."""
        m, G = len(self.cells), self.once(self.gradients_of_phi)
        H = self.ask("d2psi_dF2", F=self.once(self.deformed)[:m], **self.material(m))
        pairs = np.array(list(itertools.product(range(4), repeat=2)))
        K = self.ask(
            "stiffness_block",
            d2psi_dF2=np.repeat(H, 16, axis=0),
            grad_phi_i=G[:, pairs[:, 0]].reshape(-1, 3),
            grad_phi_j=G[:, pairs[:, 1]].reshape(-1, 3),
            volume=np.repeat(self.volume, 16),
        )
        total = np.zeros((len(self.X), 3, len(self.X), 3))
        i, j = self.cells[:, pairs[:, 0]].ravel(), self.cells[:, pairs[:, 1]].ravel()
        np.add.at(total, (i, slice(None), j), K)
        return total.reshape(self.X.size, self.X.size)

    def masses(self) -> np.ndarray:
        """Factors of the identity in the blocks of every tetrahedron, (m, 4, 4)."""
        i, j = (np.tile(a, len(self.cells)).astype(np.int32) for a in np.divmod(np.arange(16), 4))
        volume = np.repeat(self.volume, 16)
        blocks = self.ask("mass_block", i=i, j=j, volume=volume, rho=np.full(len(volume), RHO))
        return np.asarray(blocks).reshape(-1, 4, 4)

    def kinetic(self) -> np.ndarray:
        """Kinetic energies of the tetrahedra, every vertex moving along d."""
        v = self.d[self.cells]
        return np.asarray(
            self.ask(
                "kinetic_energy",
                **{f"v{k}": v[:, k] for k in range(4)},
                volume=self.volume,
                rho=np.full(len(v), RHO),
            )
        )

    def pulled(self) -> tuple[np.ndarray, np.ndarray]:
        """Energy of the spring at its end moved along d by every step and back, and the force there, unmoved."""
        ends = self.states[:, -1]
        anchor = np.tile(self.anchor, (len(ends), 1))
        l0, k = (np.full(len(ends), SPRING[name]) for name in ("l0", "k"))
        f = self.ask("spring_force", x0=ends, x1=anchor, l0=l0, k=k)
        long = np.linalg.norm(anchor - ends, axis=1)
        return SPRING["k"] / 2 * (long - SPRING["l0"]) ** 2, np.asarray(f)[0]

    def carried(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of a finer mesh as `phi` and `interpolate` carry them, and where they belong."""
        weights = np.array([[0.25, 0.25, 0.25, 0.25], [0.5, 0.5, 0, 0], [0, 0, 0.4, 0.6], [0, 0, 0, 1]])
        T = np.repeat(self.cells, len(weights), axis=0)
        weight = np.tile(weights, (len(self.cells), 1))[:, :, None]
        X, x = self.X[T], self.x[T]
        phi = self.ask("phi", X=(weight * X).sum(axis=1), **{f"X{k}": X[:, k] for k in range(4)})
        found = self.ask("interpolate", phi=phi, **{f"x{k}": x[:, k] for k in range(4)})
        return np.asarray(found), (weight * x).sum(axis=1)


def _mirrored(cells: np.ndarray) -> np.ndarray:
    """The same cube cut the other way, so that its faces meet those of the neighbour; still positive."""
    other = np.array([1, 0, 3, 2, 5, 4, 7, 6])[cells]
    return other[:, [0, 2, 1, 3]]


def _balance(solid: Solid) -> tuple[float, float]:
    g = solid.once(solid.slopes)[0]
    torque = np.cross(solid.x - solid.x.mean(axis=0), g).sum(axis=0)
    return float(max(np.abs(g.sum(axis=0)).max(), np.abs(torque).max()) / np.abs(g).sum()), BALANCE


def _turned(solid: Solid) -> tuple[float, float]:
    psi, again = solid.turned()
    return float(np.abs(psi - again).max() / np.abs(psi).max()), BALANCE


def _slope_of_energy(solid: Solid) -> tuple[float, float]:
    g = solid.once(solid.slopes)[0]
    V = solid.energies()[1:].reshape(-1, 2)
    found = (V[:, 0] - V[:, 1]) / (2 * STEPS)
    return float(np.min(np.abs(found - np.sum(g * solid.d))) / np.abs(g * solid.d).sum()), SLOPE


def _slope_of_force(solid: Solid) -> tuple[float, float]:
    g = solid.once(solid.slopes)[1:].reshape(len(STEPS), 2, -1)
    found = (g[:, 0] - g[:, 1]) / (2 * STEPS[:, None])
    right = solid.once(solid.stiffness) @ solid.d.ravel()
    return float(np.min(np.linalg.norm(found - right, axis=1)) / np.linalg.norm(right)), CURVATURE


def _symmetric(solid: Solid) -> tuple[float, float]:
    K = solid.once(solid.stiffness)
    return float(np.abs(K - K.T).max() / np.abs(K).max()), BALANCE


def _translations(solid: Solid) -> tuple[float, float]:
    K = solid.once(solid.stiffness)
    together = K.reshape(len(K), -1, 3).sum(axis=1)
    return float(np.abs(together).max() / np.abs(K).max()), BALANCE


def _mass(solid: Solid) -> tuple[float, float]:
    right = RHO * solid.volume.sum()
    return float(abs(solid.once(solid.masses).sum() - right) / right), BALANCE


def _kinetic(solid: Solid) -> tuple[float, float]:
    v = solid.d[solid.cells]
    right = np.einsum("eij,eic,ejc->e", solid.once(solid.masses), v, v) / 2
    return float(np.abs(solid.kinetic() - right).max() / np.abs(right).max()), BALANCE


def _spring(solid: Solid) -> tuple[float, float]:
    V, f = solid.pulled()
    pairs = V[1:].reshape(-1, 2)
    found = (pairs[:, 0] - pairs[:, 1]) / (2 * STEPS)
    scale = np.linalg.norm(f) * np.linalg.norm(solid.d[-1])
    return float(np.min(np.abs(found + f @ solid.d[-1])) / scale), SLOPE


def _carried(solid: Solid) -> tuple[float, float]:
    found, right = solid.carried()
    return float(np.abs(found - right).max()), BALANCE


#: What the laws are asked of.
specimen = Solid

GRADIENT = ("dphi_dX", "deformation_gradient", "dpsi_dF", "nodal_force")
HESSIAN = ("dphi_dX", "deformation_gradient", "d2psi_dF2", "stiffness_block")

laws = (
    Law("net force and torque are zero", GRADIENT, _balance),
    Law("a rotation costs no energy", ("dphi_dX", "deformation_gradient", "psi"), _turned),
    Law("force is minus the slope of the energy", ("psi", *GRADIENT), _slope_of_energy),
    Law(
        "stiffness is minus the slope of the force", tuple(dict.fromkeys(GRADIENT + HESSIAN)), _slope_of_force
    ),
    Law("the stiffness matrix is symmetric", HESSIAN, _symmetric),
    Law("translations meet no resistance", HESSIAN, _translations),
    Law("mass adds up to density times volume", ("mass_block",), _mass),
    Law("kinetic energy agrees with the mass", ("mass_block", "kinetic_energy"), _kinetic),
    Law("the spring's force is minus the slope of its energy", ("spring_force",), _spring),
    Law("a finer mesh follows the solid", ("phi", "interpolate"), _carried),
)
