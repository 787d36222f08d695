"""The functions of a submission put together on a small cloth, and the laws of mechanics they must obey then.

Runs in the grader. It asks for one function after the other, each on what the ones before it gave, and does the
given parts (singular value decomposition, its derivative, the chain rule, sums over triangles) in plain numpy:
nothing has to be compiled that is not compiled already, and no code is shared with the simulator.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from muslin.judging import Ask, Law
from muslin.physics.stand_ins import NEEDS

MATERIAL: Mapping[str, float] = {"mu": 2e3, "lam": 1.5e3, "rho": 0.2, "h": 1.0}

#: Steps of the differences that slopes are compared with [m].
STEPS = 10.0 ** -np.arange(2.0, 7.0)

#: Largest relative errors: of what cancels exactly, of a slope, of the slope of a slope.
BALANCE, SLOPE, CURVATURE = 1e-9, 1e-6, 1e-5


class Cloth:
    """A small irregular cloth, the same every time, as the functions of a submission see it.

    Everything is computed when it is first asked for, and what a function gives is asked for once.
    """

    def __init__(self, ask: Ask):
        self._ask, self._kept = ask, {}  # type: ignore[var-annotated]
        side = 5
        line = np.linspace(0, 1, side)
        u, v = (a.ravel() for a in np.meshgrid(line, line, indexing="ij"))
        k = np.arange(side * side)
        u, v = u + 0.04 * np.sin(7.0 * k + 1), v + 0.04 * np.cos(5.0 * k)
        self.X = np.stack([u, v, 0.05 * np.sin(3.0 * u + 2.0 * v)], axis=1)
        a = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
        halves = [(a, a + side, a + side + 1), (a, a + side + 1, a + 1)]
        self.triangles = np.concatenate([np.stack(half, axis=1) for half in halves])
        self.x = np.stack([1.15 * u, 0.9 * v + 0.2 * u, 0.25 * np.sin(4.0 * u) * np.cos(3.0 * v)], axis=1)
        #: a direction to move in
        self.d = np.stack([np.sin(9.0 * k), np.cos(11.0 * k + 1), np.sin(13.0 * k + 2)], axis=1)
        corners = self.X[self.triangles]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1)
        self.area, self.N = length / 2, normal / length[:, None]
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

    def _dphi(self) -> np.ndarray:
        corners = self.X[self.triangles]
        return np.asarray(self.ask("dphi_dX", **{f"X{k}": corners[:, k] for k in range(3)}))

    def _svd(self) -> tuple[np.ndarray, ...]:
        """F of every triangle in every state, (states * m, 3, 3), and U, s, V with the normal's stretch last."""
        count = len(self.states)
        corners = self.states[:, self.triangles].reshape(-1, 3, 3)
        N = np.tile(self.N, (count, 1))
        dphi = np.tile(self.once(self._dphi), (count, 1, 1))
        F = self.ask("deformation_gradient", **{f"x{k}": corners[:, k] for k in range(3)}, dphi_dX=dphi, N=N)
        other = np.where(np.abs(N[:, :1]) < 0.9, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
        t0 = np.cross(N, other)
        t0 /= np.linalg.norm(t0, axis=1)[:, None]
        frame = np.stack([t0, np.cross(N, t0)], axis=2)
        U, s, Vt = np.linalg.svd(F @ frame, full_matrices=False)
        turn = np.sign(np.linalg.det(Vt))  # U and V are rotations
        U[:, :, 1] *= turn[:, None]
        Vt[:, 1] *= turn[:, None]
        V = np.concatenate([frame @ Vt.transpose(0, 2, 1), N[:, :, None]], axis=2)
        U = np.concatenate([U, np.cross(U[:, :, 0], U[:, :, 1])[:, :, None]], axis=2)
        return F, U, np.concatenate([s, np.ones((len(s), 1))], axis=1), V

    def _stress(self) -> np.ndarray:
        _, _, s, _ = self.once(self._svd)
        return np.asarray(self.ask("dpsi_ds", s=s, **self._lame(len(s))))

    def _lame(self, count: int) -> dict[str, np.ndarray]:
        return {name: np.full(count, MATERIAL[name]) for name in ("mu", "lam")}

    def energies(self) -> np.ndarray:
        """Potential energy of every state."""
        _, _, s, _ = self.once(self._svd)
        psi = self.ask("psi", s=s, **self._lame(len(s))).reshape(len(self.states), -1)
        return np.asarray((MATERIAL["h"] * self.area * psi).sum(axis=1))

    def gradients(self) -> np.ndarray:
        """Gradient of the potential energy in every state, (states, n, 3)."""
        _, U, _, V = self.once(self._svd)
        count = len(self.states)
        P = self.ask("dpsi_dF", U=U, dpsi_ds=self.once(self._stress), V=V)
        grad_phi = np.tile(self.once(self._dphi).reshape(-1, 3), (count, 1))
        area = np.tile(np.repeat(self.area, 3), count)
        h = np.full(len(area), MATERIAL["h"])
        f = self.ask("nodal_force", P=np.repeat(P, 3, axis=0), grad_phi=grad_phi, area=area, h=h)
        total = np.zeros_like(self.states)
        for state, forces in zip(total, f.reshape(count, -1, 3), strict=True):
            np.add.at(state, self.triangles.ravel(), -forces)
        return total

    def closed(self) -> np.ndarray:
        """Hessian at x by `eigensystem`: values of known modes, (3n, 3n)."""
        m = len(self.triangles)
        _, U, s, V = (array[:m] for array in self.once(self._svd))
        p = self.once(self._stress)[:m]
        H = self.once(self._d2psi)[:m]
        flip, twist, out_0, out_1 = self.ask("eigensystem", s=s, dpsi_ds=p, d2psi_ds2=H).T
        g = self.once(self._dphi) @ V[:, :, :2]
        moved = np.einsum("eck,eil->eickl", U, g).reshape(m, 9, 3, 2)  # of F, in its principal frames
        half = np.sqrt(0.5)
        modes = np.stack(
            [
                moved[..., 0, 0],
                moved[..., 1, 1],
                half * (moved[..., 1, 0] + moved[..., 0, 1]),
                half * (moved[..., 1, 0] - moved[..., 0, 1]),
                moved[..., 2, 0],
                moved[..., 2, 1],
            ],
            axis=2,
        )
        K = np.zeros((m, 6, 6))
        K[:, :2, :2] = H[:, :2, :2]
        for k, value in enumerate((flip, twist, out_0, out_1)):
            K[:, 2 + k, 2 + k] = value
        return self._assembled(modes @ K @ modes.transpose(0, 2, 1))

    def _d2psi(self) -> np.ndarray:
        _, _, s, _ = self.once(self._svd)
        m = len(self.triangles)
        return np.asarray(self.ask("d2psi_ds2", s=s[:m], **self._lame(m)))

    def lecture(self) -> np.ndarray:
        """Hessian at x by `d2psi_dFij` and `dn_dx`: the chain rule over all nine entries of F, (3n, 3n)."""
        m = len(self.triangles)
        _, U, s, V = (array[:m] for array in self.once(self._svd))
        columns = []
        for i in range(3):
            for j in range(3):
                A = U[:, i, :, None] * V[:, j, None, :]
                columns.append((A, *_dsvd(A, U, s, V)))
        dU, ds, dV = (np.concatenate([column[k] for column in columns]) for k in (1, 2, 3))
        again = [
            np.tile(a, (9,) + (1,) * (a.ndim - 1))
            for a in (U, V, self.once(self._stress)[:m], self.once(self._d2psi))
        ]
        names = ("U", "V", "dpsi_ds", "d2psi_ds2")
        d2 = self.ask("d2psi_dFij", **dict(zip(names, again, strict=True)), dU=dU, ds=ds, dV=dV)
        d2 = d2.reshape(3, 3, m, 3, 3)  # entry F_ij moved, triangle, change of P
        corners = self.x[self.triangles]
        dF = np.zeros((m, 9, 3, 3))
        for i in range(3):
            index = np.full(m, i, dtype=np.int32)
            dn = self.ask("dn_dx", **{f"x{k}": corners[:, k] for k in range(3)}, i=index)
            for c in range(3):
                dF[:, 3 * i + c, c, :] += self.once(self._dphi)[:, i]
                dF[:, 3 * i + c] += dn[:, :, c, None] * self.N[:, None, :]
        return self._assembled(np.einsum("eapq,ijepq,ebij->eab", dF, d2, dF))

    def _assembled(self, blocks: np.ndarray) -> np.ndarray:
        """Sum of the triangles' matrices, (m, 9, 9) per h a, into the cloth's."""
        n = self.X.size
        total = np.zeros((n, n))
        rows = (3 * self.triangles[:, :, None] + np.arange(3)).reshape(-1, 9)
        weighed = MATERIAL["h"] * self.area[:, None, None] * blocks
        np.add.at(total, (rows[:, :, None], rows[:, None, :]), weighed)
        return total

    def masses(self) -> np.ndarray:
        """Factors of the identity in the blocks of every triangle, (m, 3, 3)."""
        m = len(self.triangles)
        i, j = (np.tile(a, m).astype(np.int32) for a in np.divmod(np.arange(9), 3))
        sheet = self._sheet(np.repeat(self.area, 9))
        return np.asarray(self.ask("mass_block", i=i, j=j, **sheet)).reshape(m, 3, 3)

    def kinetic(self) -> np.ndarray:
        """Kinetic energies of the triangles, every vertex moving along d."""
        v = self.d[self.triangles]
        return np.asarray(
            self.ask("kinetic_energy", **{f"v{k}": v[:, k] for k in range(3)}, **self._sheet(self.area))
        )

    def _sheet(self, area: np.ndarray) -> dict[str, np.ndarray]:
        return {"area": area, **{name: np.full(len(area), MATERIAL[name]) for name in ("rho", "h")}}

    def cauchy_green(self) -> tuple[np.ndarray, np.ndarray]:
        """C of every triangle at x, and its principal stretches."""
        m = len(self.triangles)
        F, _, s, _ = self.once(self._svd)
        return np.asarray(self.ask("right_cauchy_green", F=F[:m])), s[:m]

    def carried(self) -> tuple[np.ndarray, np.ndarray]:
        """Points of a finer mesh as `phi` and `interpolate` carry them, and where they belong."""
        weights = np.array([[0.25, 0.25, 0.5], [0.5, 0.5, 0.0], [0.0, 0.0, 1.0]])
        T = np.repeat(self.triangles, len(weights), axis=0)
        weight = np.tile(weights, (len(self.triangles), 1))[:, :, None]
        X, x = self.X[T], self.x[T]
        corners = {f"X{k}": X[:, k] for k in range(3)}
        phi = self.ask("phi", X=(weight * X).sum(axis=1), **corners)
        found = self.ask("interpolate", phi=phi, **{f"x{k}": x[:, k] for k in range(3)})
        return np.asarray(found), (weight * x).sum(axis=1)


def _dsvd(A: np.ndarray, U: np.ndarray, s: np.ndarray, V: np.ndarray) -> tuple[np.ndarray, ...]:
    """Derivatives of U, s and V where A = U^T dF V; all stretches of the small cloth lie apart."""
    row, column = s[:, :, None], s[:, None, :]
    squares = column**2 - row**2
    squares[:, range(3), range(3)] = 1.0
    At = A.transpose(0, 2, 1)
    W, Z = (column * A + row * At) / squares, (row * A + column * At) / squares
    W[:, range(3), range(3)] = Z[:, range(3), range(3)] = 0.0
    return U @ W, A[:, range(3), range(3)], V @ Z


def _balance(cloth: Cloth) -> tuple[float, float]:
    g = cloth.once(cloth.gradients)[0]
    torque = np.cross(cloth.x - cloth.x.mean(axis=0), g).sum(axis=0)
    return float(max(np.abs(g.sum(axis=0)).max(), np.abs(torque).max()) / np.abs(g).sum()), BALANCE


def _slope_of_energy(cloth: Cloth) -> tuple[float, float]:
    g = cloth.once(cloth.gradients)[0]
    V = cloth.energies()[1:].reshape(-1, 2)
    slopes = (V[:, 0] - V[:, 1]) / (2 * STEPS)
    return float(np.min(np.abs(slopes - np.sum(g * cloth.d))) / np.abs(g * cloth.d).sum()), SLOPE


def _slope_of_force(road: str) -> Callable[[Cloth], tuple[float, float]]:
    def of(cloth: Cloth) -> tuple[float, float]:
        H = cloth.once(getattr(cloth, road))
        g = cloth.once(cloth.gradients)[1:].reshape(len(STEPS), 2, -1)
        slopes = (g[:, 0] - g[:, 1]) / (2 * STEPS[:, None])
        right = H @ cloth.d.ravel()
        off = np.min(np.linalg.norm(slopes - right, axis=1)) / np.linalg.norm(right)
        return float(max(off, np.abs(H - H.T).max() / np.abs(H).max())), CURVATURE

    return of


def _translations(cloth: Cloth) -> tuple[float, float]:
    H = cloth.once(cloth.closed)
    together = H.reshape(len(H), -1, 3).sum(axis=1)
    return float(np.abs(together).max() / np.abs(H).max()), BALANCE


def _mass(cloth: Cloth) -> tuple[float, float]:
    right = MATERIAL["rho"] * MATERIAL["h"] * cloth.area.sum()
    return float(abs(cloth.once(cloth.masses).sum() - right) / right), BALANCE


def _kinetic(cloth: Cloth) -> tuple[float, float]:
    v = cloth.d[cloth.triangles]
    right = np.einsum("eij,eic,ejc->e", cloth.once(cloth.masses), v, v) / 2
    return float(np.abs(cloth.kinetic() - right).max() / np.abs(right).max()), BALANCE


def _eigenvalues(cloth: Cloth) -> tuple[float, float]:
    C, s = cloth.cauchy_green()
    found = np.linalg.eigvalsh((C + C.transpose(0, 2, 1)) / 2)
    return float(np.abs(found - np.sort(s**2, axis=1)).max()), BALANCE


def _carried(cloth: Cloth) -> tuple[float, float]:
    found, right = cloth.carried()
    return float(np.abs(found - right).max()), BALANCE


#: What the laws are asked of.
specimen = Cloth

laws = (
    Law("net force and torque are zero", NEEDS["gradient"], _balance),
    Law("force is minus the slope of the energy", (*NEEDS["energy"], *NEEDS["gradient"]), _slope_of_energy),
    Law(
        "Hessian is the slope of the force (closed form)",
        (*NEEDS["gradient"], *NEEDS["hessian"]),
        _slope_of_force("closed"),
    ),
    Law(
        "Hessian is the slope of the force (lecture's road)",
        (*NEEDS["gradient"], *NEEDS["lecture's hessian"]),
        _slope_of_force("lecture"),
    ),
    Law("translations meet no resistance", NEEDS["hessian"], _translations),
    Law("mass adds up to density times area", NEEDS["mass"], _mass),
    Law("kinetic energy agrees with the mass", (*NEEDS["mass"], *NEEDS["kinetic energy"]), _kinetic),
    Law(
        "squares of the stretches are eigenvalues of C",
        ("dphi_dX", "deformation_gradient", "right_cauchy_green"),
        _eigenvalues,
    ),
    Law("a finer mesh follows the cloth", (*NEEDS["binding"], *NEEDS["carrying"]), _carried),
)
