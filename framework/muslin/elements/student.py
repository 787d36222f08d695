"""The lecture's element: the student's functions on the 3x3 deformation gradient, F N = n.

Each student function runs in a small kernel of its own, so an edit recompiles that kernel only; the singular
value decomposition, its derivative, the chain rule and the sums are the framework's and stay compiled.
"""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import taichi as ti

from muslin import given
from muslin.batch import evaluate, kept, run
from muslin.elements.arrays import index3, mat3s, scalars, vec3s, vec4s
from muslin.elements.modes import block, clamp_stretch
from muslin.errors import SimulationError
from muslin.material import ENERGIES, FLIPS
from muslin.tasks import Functions, usable

#: Gap of stretches below which the framework's own energies use their simplified flip.
NEARLY_EQUAL = 1e-3


class StudentElement:
    """Energy, gradient and Hessian of every triangle, by the functions of a folder.

    Parameters
    ----------
    functions : Functions
        What `muslin.load` returned.
    X, triangles, area, normal, mu, lam, h, energy
        As for `NativeElement`.
    hessian : {"closed", "lecture"}
        Road to the Hessian: `eigensystem`, or `d2psi_dFij` and `dn_dx`.
    """

    def __init__(
        self,
        functions: Functions,
        X: np.ndarray,
        triangles: np.ndarray,
        area: np.ndarray,
        normal: np.ndarray,
        mu: float,
        lam: float,
        h: float,
        energy: str,
        hessian: str,
    ):
        self.X, self.triangles, self.area, self.normal = X, triangles, area, normal
        self.mu, self.lam, self.h = mu, lam, h
        self.road = hessian
        self.functions = functions
        f = SimpleNamespace(**{function.task.name: function for function in functions})  # type: ignore[attr-defined]
        self.flip = FLIPS.get(energy)
        if ENERGIES[energy] is not None:
            f.psi, f.dpsi_ds, f.d2psi_ds2 = ENERGIES[energy]
        self.f = f
        corners = {f"X{k}": X[triangles[:, k]] for k in range(3)}
        self.dphi = evaluate(f.dphi_dX, **corners)

    def _launch(self, name: str, *arguments: Any) -> None:
        """Run the kernel around student function `name`, made on first use, and look at what it returned."""
        function = usable(getattr(self.f, name))
        run(kept(function, name, lambda: KERNELS[name](function)), function, *arguments)
        result = arguments[-1]
        if not np.isfinite(result).all():
            self._complain(name, result)

    def _require_triangles(self, x: np.ndarray) -> None:
        """Refuse positions no deformation gradient exists for, before a student's function is blamed for it."""
        if not np.isfinite(x).all():
            raise SimulationError("A position is not a number.", "Reduce dt, or check force and Hessian.")
        a, b, c = (x[self.triangles[:, k]] for k in range(3))
        flat = np.flatnonzero((np.cross(b - a, c - a) ** 2).sum(axis=1) == 0)
        if len(flat):
            corners = ", ".join(map(str, self.triangles[flat[0]]))
            raise SimulationError(
                f"Triangle {flat[0]} (vertices {corners}) has collapsed and has no normal.",
                "Reduce dt, or look at how the scene starts.",
            )

    def _complain(self, name: str, result: np.ndarray) -> None:
        bad = ~np.isfinite(result).reshape(len(result), -1).all(axis=1)
        e = int(np.flatnonzero(bad)[0]) * len(self.triangles) // len(result)
        corners = ", ".join(map(str, self.triangles[e]))
        raise SimulationError(
            f"{name} returns a number that is not finite (NaN or infinity) in triangle {e} (vertices {corners}).",
            f"Look for a division by zero or a square root of something negative. Try: muslin check {name}",
        )

    def update(self, x: np.ndarray) -> None:
        """Take new positions (n, 3): deformation gradients and their singular value decompositions."""
        m = len(self.triangles)
        self.x = x
        self._require_triangles(x)
        self.F, self.U, self.V, self.s = (
            np.empty((m, 3, 3)),
            np.empty((m, 3, 3)),
            np.empty((m, 3, 3)),
            np.empty((m, 3)),
        )
        self._launch("deformation_gradient", x, self.triangles, self.dphi, self.normal, self.F)
        _svd(self.F, self.normal, self.U, self.s, self.V)
        self._stress: np.ndarray | None = None

    def _dpsi_ds(self) -> np.ndarray:
        """Gradient of psi in the stretches here, (m, 3) [Pa]: gradient and Hessian both need it."""
        if self._stress is None:
            self._stress = np.empty_like(self.s)
            self._launch("dpsi_ds", self.s, self.mu, self.lam, self._stress)
        return self._stress

    def energies(self) -> np.ndarray:
        """Potential energy of each triangle, (m,) [J]."""
        out = np.empty(len(self.s))
        self._launch("psi", self.s, self.mu, self.lam, out)
        return self.h * self.area * out

    def gradients(self) -> np.ndarray:
        """Gradient of each triangle's energy in its corners, (3 m, 3) [N]."""
        P, out = np.empty_like(self.F), np.empty((3 * len(self.s), 3))
        self._launch("dpsi_dF", self.U, self._dpsi_ds(), self.V, P)
        self._launch("nodal_force", P, self.dphi, self.area, self.h, out)
        np.negative(out, out=out)
        return out

    def hessians(self, project: bool) -> np.ndarray:
        """Hessian of each triangle's energy, (9 m, 3, 3) blocks, corner by corner [N/m]."""
        return self._lecture(project) if self.road == "lecture" else self._closed(project)

    def _closed(self, project: bool) -> np.ndarray:
        m = len(self.s)
        H, modes, out = np.empty_like(self.F), np.empty((m, 4)), np.empty((9 * m, 3, 3))
        self._launch("d2psi_ds2", self.s, self.mu, self.lam, H)
        self._launch("eigensystem", self.s, self._dpsi_ds(), H, modes)
        if self.flip is not None:
            # Where stretches nearly meet, neither quotient nor limit keeps more than ten digits of an energy that
            # is not quadratic. The framework's own energies know what the quotient simplifies to.
            close = self.s[:, 0] - self.s[:, 1] < NEARLY_EQUAL
            modes[close, 0] = self.flip(self.s[close], self.mu, self.lam)
        _closed_blocks(self.U, self.V, H, modes, self.dphi, self.area, self.h, int(project), out)
        return out

    def _lecture(self, project: bool) -> np.ndarray:
        m = len(self.s)
        s, p, H = np.empty_like(self.s), np.empty_like(self.s), np.empty_like(self.F)
        columns, dn, out = np.empty((9 * m, 3, 3)), np.empty((3 * m, 3, 3)), np.empty((9 * m, 3, 3))
        _split(self.s, s)  # U, V and these stretches belong to one nearby matrix; forces use the true ones
        self._launch("dpsi_ds", s, self.mu, self.lam, p)
        self._launch("d2psi_ds2", s, self.mu, self.lam, H)
        self._launch("d2psi_dFij", self.U, s, self.V, p, H, columns)
        self._launch("dn_dx", self.x, self.triangles, dn)
        _chain_rule(columns, dn, self.dphi, self.normal, self.area, self.h, out)
        if project:
            _clamp_known_modes(self.X, self.triangles, self.U, self.V, self.dphi, self.area, self.h, out)
        return out


# Kernels around student functions -------------------------------------------------------------------------


def _deformation_gradient(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(x: vec3s, triangles: index3, dphi: mat3s, N: vec3s, F: mat3s):
        for e in range(F.shape[0]):
            t = triangles[e]
            F[e] = f(x[t[0]], x[t[1]], x[t[2]], dphi[e], N[e])

    return kernel


def _psi(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, mu: ti.f64, lam: ti.f64, out: scalars):
        for e in range(s.shape[0]):
            out[e] = f(s[e], mu, lam)

    return kernel


def _dpsi_ds(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, mu: ti.f64, lam: ti.f64, out: vec3s):
        for e in range(s.shape[0]):
            out[e] = f(s[e], mu, lam)

    return kernel


def _d2psi_ds2(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, mu: ti.f64, lam: ti.f64, out: mat3s):
        for e in range(s.shape[0]):
            out[e] = f(s[e], mu, lam)

    return kernel


def _dpsi_dF(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(U: mat3s, dpsi_ds: vec3s, V: mat3s, P: mat3s):
        for e in range(P.shape[0]):
            P[e] = f(U[e], dpsi_ds[e], V[e])

    return kernel


def _nodal_force(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(P: mat3s, dphi: mat3s, area: scalars, h: ti.f64, out: vec3s):
        for row in range(out.shape[0]):
            e, i = row // 3, row % 3
            out[row] = f(P[e], ti.Vector([dphi[e][i, 0], dphi[e][i, 1], dphi[e][i, 2]]), area[e], h)

    return kernel


def _eigensystem(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, dpsi_ds: vec3s, d2psi_ds2: mat3s, modes: vec4s):
        for e in range(s.shape[0]):
            modes[e] = f(s[e], dpsi_ds[e], d2psi_ds2[e])

    return kernel


def _d2psi_dFij(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(U: mat3s, s: vec3s, V: mat3s, dpsi_ds: vec3s, d2psi_ds2: mat3s, columns: mat3s):
        for row in range(columns.shape[0]):
            e, k = row // 9, row % 9
            dU, ds, dV = given.dsvd(U[e], s[e], V[e], k // 3, k % 3)
            columns[row] = f(U[e], V[e], dpsi_ds[e], d2psi_ds2[e], dU, ds, dV)

    return kernel


def _dn_dx(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(x: vec3s, triangles: index3, dn: mat3s):
        for row in range(dn.shape[0]):
            t = triangles[row // 3]
            dn[row] = f(x[t[0]], x[t[1]], x[t[2]], row % 3)

    return kernel


#: How each student function is called on all triangles.
KERNELS: dict[str, Callable[[Callable[..., Any]], Callable[..., None]]] = {
    "deformation_gradient": _deformation_gradient,
    "psi": _psi,
    "dpsi_ds": _dpsi_ds,
    "d2psi_ds2": _d2psi_ds2,
    "dpsi_dF": _dpsi_dF,
    "nodal_force": _nodal_force,
    "eigensystem": _eigensystem,
    "d2psi_dFij": _d2psi_dFij,
    "dn_dx": _dn_dx,
}

# The framework's kernels ----------------------------------------------------------------------------------


@ti.kernel
def _svd(F: mat3s, N: vec3s, U: mat3s, s: vec3s, V: mat3s):
    for e in range(F.shape[0]):
        U[e], s[e], V[e] = given.svd(F[e], N[e])


@ti.kernel
def _split(s: vec3s, out: vec3s):
    for e in range(s.shape[0]):
        out[e] = given.split(s[e])


@ti.func
def _in_frame(dphi, V, i):
    """Gradient of phi_i in the frame (v_0, v_1)."""
    g = ti.Vector([dphi[i, 0], dphi[i, 1], dphi[i, 2]])
    return ti.Vector(
        [
            V[0, 0] * g[0] + V[1, 0] * g[1] + V[2, 0] * g[2],
            V[0, 1] * g[0] + V[1, 1] * g[1] + V[2, 1] * g[2],
        ]
    )


@ti.kernel
def _closed_blocks(
    U: mat3s,
    V: mat3s,
    d2psi_ds2: mat3s,
    modes: vec4s,
    dphi: mat3s,
    area: scalars,
    h: ti.f64,
    project: ti.i32,
    out: mat3s,
):
    for e in range(U.shape[0]):
        H, flip, twist, out0, out1 = d2psi_ds2[e], modes[e][0], modes[e][1], modes[e][2], modes[e][3]
        a, b, c = H[0, 0], H[1, 1], (H[0, 1] + H[1, 0]) / 2
        if project == 1:
            a, b, c = clamp_stretch(a, b, c)
            flip, twist = ti.max(flip, 0.0), ti.max(twist, 0.0)
            out0, out1 = ti.max(out0, 0.0), ti.max(out1, 0.0)
        stretch, outs = ti.Vector([a, b, c]), ti.Vector([out0, out1])
        for i in range(3):
            gi = _in_frame(dphi[e], V[e], i)
            for j in range(i, 3):
                gj = _in_frame(dphi[e], V[e], j)
                B = h * area[e] * block(U[e], gi, gj, stretch, flip, twist, outs)
                out[9 * e + 3 * i + j] = B
                if j > i:
                    out[9 * e + 3 * j + i] = B.transpose()


@ti.kernel
def _chain_rule(columns: mat3s, dn: mat3s, dphi: mat3s, N: vec3s, area: scalars, h: ti.f64, out: mat3s):
    """H = h a (dF/dq)^T psi'' (dF/dq) with dF/dx_i = (. grad phi_i^T) + dn/dx_i N^T."""
    for e in range(dphi.shape[0]):
        for j in range(3):
            g = ti.Vector([dphi[e][j, 0], dphi[e][j, 1], dphi[e][j, 2]])
            for d in range(3):  # move vertex j along axis d
                dP = ti.Matrix.zero(float, 3, 3)
                for a in range(3):
                    for b in range(3):
                        dF = dn[3 * e + j][a, d] * N[e][b]
                        if a == d:
                            dF += g[b]
                        dP += dF * columns[9 * e + 3 * a + b]
                for i in range(3):
                    gi = ti.Vector([dphi[e][i, 0], dphi[e][i, 1], dphi[e][i, 2]])
                    force = h * area[e] * (dP @ gi + dn[3 * e + i].transpose() @ (dP @ N[e]))
                    for a in ti.static(range(3)):
                        out[9 * e + 3 * i + j][a, d] = force[a]
        # Where terms of size 1 / SPLIT have cancelled, their rounding is left over: a translation would pull.
        # Vertex 0 takes it up, if it is no more than that.
        size, left = 0.0, 0.0
        for k in range(9):
            size += out[9 * e + k].norm_sqr()
        for i in range(3):
            left += (out[9 * e + 3 * i] + out[9 * e + 3 * i + 1] + out[9 * e + 3 * i + 2]).norm_sqr()
            left += (out[9 * e + i] + out[9 * e + 3 + i] + out[9 * e + 6 + i]).norm_sqr()
        if left < 1e-16 * size:
            for i in range(1, 3):
                out[9 * e + 3 * i] = -out[9 * e + 3 * i + 1] - out[9 * e + 3 * i + 2]
            for j in range(3):
                out[9 * e + j] = -out[9 * e + 3 + j] - out[9 * e + 6 + j]


@ti.kernel
def _clamp_known_modes(
    X: vec3s, triangles: index3, U: mat3s, V: mat3s, dphi: mat3s, area: scalars, h: ti.f64, out: mat3s
):
    """Read the modes off a Hessian by contraction with their known directions, and lift negative ones to zero."""
    for e in range(U.shape[0]):
        t = triangles[e]
        half = ti.sqrt(0.5)
        edge1, edge2 = X[t[1]] - X[t[0]], X[t[2]] - X[t[0]]
        H11, H12, H21, H22 = out[9 * e + 4], out[9 * e + 5], out[9 * e + 7], out[9 * e + 8]
        # mode k is the sum of A[k][a, b] u_a v_b^T: two stretches, flip, twist, out_0, out_1
        value = ti.Matrix.zero(float, 3, 2)
        coupling = 0.0
        for k in range(6):
            w1, w2 = _moves(k, half, U[e], V[e], edge1, edge2)
            z1, z2 = H11 @ w1 + H12 @ w2, H21 @ w1 + H22 @ w2
            value[k // 2, k % 2] = (w1.dot(z1) + w2.dot(z2)) / (h * area[e])
            if k == 1:
                w1, w2 = _moves(0, half, U[e], V[e], edge1, edge2)
                coupling = (w1.dot(z1) + w2.dot(z2)) / (h * area[e])
        a, b, c = clamp_stretch(value[0, 0], value[0, 1], coupling)
        lift = ti.Matrix(
            [
                [a - value[0, 0], b - value[0, 1]],
                [ti.max(-value[1, 0], 0.0), ti.max(-value[1, 1], 0.0)],
                [ti.max(-value[2, 0], 0.0), ti.max(-value[2, 1], 0.0)],
            ]
        )
        stretch = ti.Vector([lift[0, 0], lift[0, 1], c - coupling])
        outs = ti.Vector([lift[2, 0], lift[2, 1]])
        for i in range(3):
            gi = _in_frame(dphi[e], V[e], i)
            for j in range(3):
                gj = _in_frame(dphi[e], V[e], j)
                out[9 * e + 3 * i + j] += (
                    h * area[e] * block(U[e], gi, gj, stretch, lift[1, 0], lift[1, 1], outs)
                )


@ti.func
def _moves(k, half, U, V, edge1, edge2):
    """How vertices 1 and 2 move (vertex 0 stays) so that F changes by unit mode k."""
    u0, u1, n = U[:, 0], U[:, 1], U[:, 2]
    v0, v1 = V[:, 0], V[:, 1]
    left0, left1 = u0, 0.0 * u0  # the mode is left0 v_0^T + left1 v_1^T
    if k == 1:
        left0, left1 = 0.0 * u0, u1
    elif k == 2:
        left0, left1 = half * u1, half * u0
    elif k == 3:
        left0, left1 = -half * u1, half * u0
    elif k == 4:
        left0, left1 = n, 0.0 * u0
    elif k == 5:
        left0, left1 = 0.0 * u0, n
    return left0 * v0.dot(edge1) + left1 * v1.dot(edge1), left0 * v0.dot(edge2) + left1 * v1.dot(edge2)
