"""The lecture's element: the student's functions on the 3x3 deformation gradient, F N = n.

One kernel calls all the functions a part of the cloth needs, triangle by triangle. Where something goes wrong
in it, each function is called once more in a kernel of its own, which names the function, the line or the
triangle. The lecture's road to the Hessian goes by those single kernels too.
"""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from muslin import given, runtime
from muslin.batch import evaluate, kept, run
from muslin.elements import modes
from muslin.elements.arrays import REAL, index3, integers, mat3s, rows, scalars, vec3s, vec4s
from muslin.elements.launch import Launch, is_small
from muslin.engine import ti
from muslin.errors import SimulationError
from muslin.material import ENERGIES, FLIPS
from muslin.stand_ins import NEEDS
from muslin.tasks import Functions, failure_of, usable

#: Gap of stretches below which the framework's own energies use their simplified flip.
NEARLY_EQUAL = 1e-3


class StudentElement:
    """Energy, gradient and Hessian of every triangle, by the functions of a folder.

    Parameters
    ----------
    functions : Functions
        What `muslin.load` returned.
    parts : some of "energy", "gradient", "hessian"
        What this element will be asked for: no other function is called.
    X, triangles, area, normal, mu, lam, h, energy
        As for `NativeElement`.
    hessian : {"closed", "lecture"}
        Road to the Hessian: `eigensystem`, or `d2psi_dFij` and `dn_dx`.
    """

    def __init__(
        self,
        functions: Functions,
        parts: Sequence[str],
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
        m = len(triangles)
        self.X, self.triangles, self.area, self.normal = X, triangles, area, normal
        self.mu, self.lam, self.h = mu, lam, h
        self.road = hessian
        f = SimpleNamespace(**{function.task.name: function for function in functions})  # type: ignore[attr-defined]
        self.flip = FLIPS.get(energy)
        if ENERGIES[energy] is not None:
            f.psi, f.dpsi_ds, f.d2psi_ds2 = ENERGIES[energy]
        self.f = f
        corners = {f"X{k}": X[triangles[:, k]] for k in range(3)}
        self.dphi = evaluate(f.dphi_dX, **corners)
        self.x, self._energies, self.gradient_rows = X.copy(), np.zeros(m), np.zeros((3 * m, 3))
        self.rows = np.zeros((m, modes.LENGTH) if hessian == "closed" else (9 * m, 3, 3))
        #: what to compute, whether to project, and what the kernel answers: 1 if a result is not finite
        self._orders = np.zeros(3, dtype=np.int32)
        self._done, self._projected = 0, False
        self._state: dict[str, np.ndarray] = {}
        self._able = sum(PARTS[part] for part in parts if self._can(part))
        self._launch: Launch | None = None

    def _can(self, part: str) -> bool:
        """Whether the fused kernel can compute a part: all functions it needs may be called."""
        if part == "hessian" and self.road == "lecture":
            return False
        return all(failure_of(getattr(self.f, name)) is None for name in NEEDS[part])

    def update(self, x: np.ndarray) -> None:
        """Take new positions (n, 3)."""
        self.x[...] = x
        self._done = 0
        self._state.clear()

    def compute(self, *parts: str, project: bool = True) -> None:
        """Compute parts ("energy", "gradient", "hessian") here, in one go, unless they are known already.

        Raises
        ------
        SimulationError
            If a triangle has collapsed, or a function returns what is not a finite number.
        StudentCodeError, NotImplementedYet
            If a function cannot be compiled or is still the stub.
        """
        wanted = sum(PARTS[part] for part in parts)
        if project is not self._projected:
            self._done &= ~PARTS["hessian"]
        missing = wanted & ~self._done
        if self.road == "lecture" and missing & PARTS["hessian"]:
            self._lecture(project)
            missing &= ~PARTS["hessian"]
        if missing:
            self._run_fused(missing, project)
        self._done |= wanted
        if wanted & PARTS["hessian"]:
            self._projected = project

    def _run_fused(self, parts: int, project: bool) -> None:
        if parts & ~self._able:
            self._explain(parts)
            self._able, self._launch = parts, None
        self._orders[:] = parts, project, 0
        try:
            if self._launch is None:
                self._launch = self._fused()
            self._launch()
        except Exception:
            self._explain(parts)  # says better what is wrong, and where
            if self._able == parts:
                raise
            self._able, self._launch = parts, None  # what is wrong belongs to another part
            return self._run_fused(parts, project)
        if self._orders[2]:
            self._explain(parts)

    def energies(self) -> np.ndarray:
        """Potential energy of each triangle, (m,) [J]."""
        self.compute("energy", project=self._projected)
        return self._energies

    def gradients(self) -> np.ndarray:
        """Gradient of each triangle's energy in its corners, (3 m, 3) [N]."""
        self.compute("gradient", project=self._projected)
        return self.gradient_rows

    def _fused(self) -> Launch:
        f, parts = self.f, self._able
        names = (
            "deformation_gradient",
            "psi",
            "dpsi_ds",
            "dpsi_dF",
            "nodal_force",
            "d2psi_ds2",
            "eigensystem",
        )
        functions = tuple(getattr(f, name) for name in names)
        serial = is_small(len(self.triangles), 100)
        key = ("fused", parts, serial, self.flip, functions)
        kernel = kept(f.deformation_gradient, key, lambda: _fused(*functions, self.flip, parts, serial))
        rest = (self.dphi, self.normal, self.area, self.mu, self.lam, self.h)
        modes_here = self.rows if self.road == "closed" else np.zeros((0, modes.LENGTH))
        out = (self._energies, self.gradient_rows, modes_here)
        return Launch(kernel, self._orders, self.x, self.triangles, *rest, *out)

    # One function at a time -----------------------------------------------------------------------------------

    def _single(self, name: str, *arguments: Any) -> None:
        """Run the kernel around student function `name`, made on first use, and look at what it returned."""
        function = usable(getattr(self.f, name))
        run(kept(function, name, lambda: KERNELS[name](function)), function, *arguments)
        result = arguments[-1]
        if not np.isfinite(result).all():
            self._complain(name, result)

    def _require_triangles(self) -> None:
        """Refuse positions no deformation gradient exists for, before a student's function is blamed for it."""
        x = self.x
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

    def _decomposed(self) -> SimpleNamespace:
        """F, U, s, V and dpsi_ds of every triangle here."""
        if not self._state:
            m = len(self.triangles)
            self._require_triangles()
            F, U, V, s, p = *(np.empty((m, 3, 3)) for _ in range(3)), np.empty((m, 3)), np.empty((m, 3))
            self._single("deformation_gradient", self.x, self.triangles, self.dphi, self.normal, F)
            runtime.call(_svd, F, self.normal, U, s, V)
            self._state = {"F": F, "U": U, "V": V, "s": s, "p": p}
        return SimpleNamespace(**self._state)

    def _explain(self, parts: int) -> None:
        """Call the functions behind these parts one by one, until one fails: its name is in the exception."""
        self._state.clear()
        at = self._decomposed()
        m = len(self.triangles)
        if parts & PARTS["energy"]:
            self._single("psi", at.s, self.mu, self.lam, np.empty(m))
        if parts & (PARTS["gradient"] | PARTS["hessian"]):
            self._single("dpsi_ds", at.s, self.mu, self.lam, at.p)
        if parts & PARTS["gradient"]:
            P = np.empty((m, 3, 3))
            self._single("dpsi_dF", at.U, at.p, at.V, P)
            self._single("nodal_force", P, self.dphi, self.area, self.h, np.empty((3 * m, 3)))
        if parts & PARTS["hessian"]:
            H = np.empty((m, 3, 3))
            self._single("d2psi_ds2", at.s, self.mu, self.lam, H)
            self._single("eigensystem", at.s, at.p, H, np.empty((m, 4)))

    # The lecture's road -----------------------------------------------------------------------------------------

    def _lecture(self, project: bool) -> None:
        """Hessian of each triangle's energy on the lecture's road: `rows`, corner by corner [N/m]."""
        at = self._decomposed()
        m = len(self.triangles)
        s, p, H = np.empty_like(at.s), np.empty_like(at.s), np.empty_like(at.F)
        columns, dn, out = np.empty((9 * m, 3, 3)), np.empty((3 * m, 3, 3)), self.rows
        # U, V and the stretches split apart belong to one nearby matrix; forces use the true ones
        runtime.call(_split, at.s, s)
        self._single("dpsi_ds", s, self.mu, self.lam, p)
        self._single("d2psi_ds2", s, self.mu, self.lam, H)
        self._single("d2psi_dFij", at.U, s, at.V, p, H, columns)
        self._single("dn_dx", self.x, self.triangles, dn)
        runtime.call(_chain_rule, columns, dn, self.dphi, self.normal, self.area, self.h, out)
        if project:
            modes_at = (at.U, at.V, self.dphi, self.area, self.h, out)
            runtime.call(_clamp_known_modes, self.X, self.triangles, *modes_at)


#: Parts of the fused kernel, as bits.
PARTS = {"energy": 1, "gradient": 2, "hessian": 4}


def _fused(
    deformation_gradient: Callable[..., Any],
    psi: Callable[..., Any],
    dpsi_ds: Callable[..., Any],
    dpsi_dF: Callable[..., Any],
    nodal_force: Callable[..., Any],
    d2psi_ds2: Callable[..., Any],
    eigensystem: Callable[..., Any],
    known_flip: Callable[..., Any] | None,
    able: int,
    serial: bool,
) -> Callable[..., None]:
    """Kernel of the parts in `able`; the first entry of `orders` chooses among them."""
    flips = known_flip is not None

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        triangles: index3,
        dphi: mat3s,
        N: vec3s,
        area: scalars,
        mu: REAL,
        lam: REAL,
        h: REAL,
        energy: scalars,
        gradient: vec3s,
        row: rows,
    ):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            x0, x1, x2 = x[t[0]], x[t[1]], x[t[2]]
            B = dphi[e]
            F = ti.Matrix.zero(float, 3, 3)
            F = deformation_gradient(x0, x1, x2, B, N[e])
            U, s, V = given.svd(F, N[e])
            seen = 0.0  # something of every result, to notice what is not finite
            p = ti.Vector([0.0, 0.0, 0.0])
            if ti.static(able & 1):  # noqa: SIM102 (known when compiling, and when running)
                if orders[0] & 1:
                    energy[e] = h * area[e] * psi(s, mu, lam)
                    seen += energy[e]
            if ti.static(able & 6):  # noqa: SIM102
                if orders[0] & 6:
                    p = dpsi_ds(s, mu, lam)
            if ti.static(able & 2):  # noqa: SIM102
                if orders[0] & 2:
                    P = ti.Matrix.zero(float, 3, 3)
                    P = dpsi_dF(U, p, V)
                    for i in range(3):
                        force = ti.Vector([0.0, 0.0, 0.0])
                        force = nodal_force(
                            P, ti.Vector([dphi[e][i, 0], dphi[e][i, 1], dphi[e][i, 2]]), area[e], h
                        )
                        gradient[3 * e + i] = -force
                        seen += force.sum()
            if ti.static(able & 4):  # noqa: SIM102
                if orders[0] & 4:
                    H = ti.Matrix.zero(float, 3, 3)
                    H = d2psi_ds2(s, mu, lam)
                    q = ti.Vector([0.0, 0.0, 0.0, 0.0])
                    q = eigensystem(s, p, H)
                    flip = q[0]
                    if ti.static(flips):  # noqa: SIM102
                        # Where stretches nearly meet, neither quotient nor limit keeps more than ten digits of an
                        # energy that is not quadratic. The framework's own know what the quotient simplifies to.
                        if s[0] - s[1] < NEARLY_EQUAL:
                            flip = known_flip(s, mu, lam)
                    stretch = ti.Vector([H[0, 0], H[1, 1], (H[0, 1] + H[1, 0]) / 2])
                    g0, g1, g2 = _in_frame(B, V, 0), _in_frame(B, V, 1), _in_frame(B, V, 2)
                    w = h * area[e]
                    modes.store(row, e, U, g0, g1, g2, stretch, flip, q[1], q[2], q[3], w, orders[1])
                    seen += H.sum() + q.sum()
            if not (ti.abs(seen) < ti.math.inf) or (x1 - x0).cross(x2 - x0).norm_sqr() == 0:
                orders[2] = 1

    return kernel


class KineticEnergy:
    """Kinetic energy of every triangle, by the student's function.

    Parameters
    ----------
    function : taichi function
    n : int
        Number of vertices.
    triangles : (m, 3), area : (m,), rho, h
    """

    def __init__(
        self,
        function: Callable[..., Any],
        n: int,
        triangles: np.ndarray,
        area: np.ndarray,
        rho: float,
        h: float,
    ):
        self.function = usable(function)
        self._v, self._out = np.zeros((n, 3)), np.zeros(len(triangles))
        serial = is_small(len(triangles), 20)
        kernel = kept(function, ("kinetic_energy", serial), lambda: _kinetic_energy(function, serial))
        self._launch = Launch(kernel, self._v, triangles, area, rho, h, self._out)

    def __call__(self, v: np.ndarray) -> np.ndarray:
        """(m,) [J] for velocities (n, 3)."""
        self._v[...] = v
        run(self._launch, self.function)
        return self._out


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
    def kernel(s: vec3s, mu: REAL, lam: REAL, out: scalars):
        for e in range(s.shape[0]):
            out[e] = f(s[e], mu, lam)

    return kernel


def _dpsi_ds(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, mu: REAL, lam: REAL, out: vec3s):
        for e in range(s.shape[0]):
            out[e] = f(s[e], mu, lam)

    return kernel


def _d2psi_ds2(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(s: vec3s, mu: REAL, lam: REAL, out: mat3s):
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
    def kernel(P: mat3s, dphi: mat3s, area: scalars, h: REAL, out: vec3s):
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


def _kinetic_energy(f: Callable[..., Any], serial: bool) -> Callable[..., None]:
    @ti.kernel
    def kernel(v: vec3s, triangles: index3, area: scalars, rho: REAL, h: REAL, out: scalars):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            out[e] = f(v[t[0]], v[t[1]], v[t[2]], area[e], rho, h)

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
def _chain_rule(columns: mat3s, dn: mat3s, dphi: mat3s, N: vec3s, area: scalars, h: REAL, out: mat3s):
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
    X: vec3s, triangles: index3, U: mat3s, V: mat3s, dphi: mat3s, area: scalars, h: REAL, out: mat3s
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
        a, b, c = modes.clamp_stretch(value[0, 0], value[0, 1], coupling)
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
                    h * area[e] * modes.block(U[e], gi, gj, stretch, lift[1, 0], lift[1, 1], outs)
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
