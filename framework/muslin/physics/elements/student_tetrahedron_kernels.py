"""Kernels around the functions of the solids assignment: all of them at once, and each by itself."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from muslin.base.arrays import REAL, index4, integers, mat3s, mat4x3s, mat9s, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements.decompose import clamped, signed_svd
from muslin.physics.elements.element import PARTS

#: The functions in the fused kernel.
CALLED = ("deformation_gradient", "psi", "dpsi_dF", "nodal_force", "d2psi_dF2", "stiffness_block")


@ti.func
def corner(dphi: ti.template(), e, i):
    """Gradient of the shape function of corner i of cell e, vec3."""
    return ti.Vector([dphi[e][i, 0], dphi[e][i, 1], dphi[e][i, 2]])


def fused(f: SimpleNamespace, able: int, serial: bool) -> Callable[..., None]:
    """Kernel of some parts, as bits; see `CallingElement` for its `orders`."""
    deformation_gradient, psi = f.deformation_gradient, f.psi
    gradient_of, hessian_of = _gradient(f), _hessian(f)
    energies, gradients, hessians = (bool(able & bit) for bit in PARTS.values())

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        cells: index4,
        dphi: mat4x3s,
        volume: scalars,
        C: REAL,
        D: REAL,
        energy: scalars,
        gradient: vec3s,
        blocks: mat3s,
    ):
        ti.loop_config(serialize=serial)
        for e in range(cells.shape[0]):
            t = cells[e]
            F = ti.Matrix.zero(float, 3, 3)
            F = deformation_gradient(x[t[0]], x[t[1]], x[t[2]], x[t[3]], dphi[e])
            seen = 0.0  # something of every result, to notice what is not finite
            upright = F.determinant() > 0
            if ti.static(energies):  # noqa: SIM102 (known when compiling, and when running)
                if orders[0] & 1:
                    energy[e] = ti.math.inf
                    if upright:
                        energy[e] = volume[e] * psi(F, C, D)
                    seen += energy[e]
            if upright:
                if ti.static(gradients):  # noqa: SIM102
                    if orders[0] & 2:
                        seen += gradient_of(e, F, C, D, dphi, volume[e], gradient)
                if ti.static(hessians):  # noqa: SIM102
                    if orders[0] & 4:
                        seen += hessian_of(e, F, C, D, dphi, volume[e], orders[1], blocks)
            if not (ti.abs(seen) < ti.math.inf) or not upright:
                orders[2] = 1

    return kernel


def _gradient(f: SimpleNamespace) -> Any:
    dpsi_dF, nodal_force = f.dpsi_dF, f.nodal_force

    @ti.func
    def gradient_of(e, F, C, D, dphi: ti.template(), volume, gradient: ti.template()):
        """Minus the force on each corner of tetrahedron e; returns something of all of them."""
        P = ti.Matrix.zero(float, 3, 3)
        P = dpsi_dF(F, C, D)
        seen = 0.0
        for i in range(4):
            force = ti.Vector([0.0, 0.0, 0.0])
            force = nodal_force(P, corner(dphi, e, i), volume)
            gradient[4 * e + i] = -force
            seen += force.sum()
        return seen

    return gradient_of


def _hessian(f: SimpleNamespace) -> Any:
    d2psi_dF2, stiffness_block = f.d2psi_dF2, f.stiffness_block

    @ti.func
    def hessian_of(e, F, C, D, dphi: ti.template(), volume, project, blocks: ti.template()):
        """The stiffness of tetrahedron e, block by block; returns something of all of it."""
        H = ti.Matrix.zero(float, 9, 9)
        H = d2psi_dF2(F, C, D)
        if project == 1:
            U, _, V = signed_svd(F)
            raised = lift(H, U, V)
            H = raised
        seen = 0.0
        for k in range(16):
            i, j = k // 4, k % 4
            if project == 1 and i > j:  # what is projected is symmetric
                blocks[16 * e + k] = blocks[16 * e + 4 * j + i].transpose()
            else:
                K = ti.Matrix.zero(float, 3, 3)
                K = stiffness_block(H, corner(dphi, e, i), corner(dphi, e, j), volume)
                blocks[16 * e + k] = K
                seen += K.sum()
        return seen

    return hessian_of


@ti.func
def _times(H, E):
    """H E, with E a mat3 as nine entries row by row."""
    out = ti.Matrix.zero(float, 3, 3)
    for r in range(9):
        total = 0.0
        for c in range(9):
            total += H[r, c] * E[c // 3, c % 3]
        out[r // 3, r % 3] = total
    return out


@ti.func
def lift(H, U, V):
    """A Hessian of psi, mat9, with its negative modes taken away; they lie in the frame of U and V."""
    result = H
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        ui, uj, vi, vj = column(U, i), column(U, j), column(V, i), column(V, j)
        for side in range(2):
            sign = 1.0 - 2.0 * side
            E = (ui.outer_product(vj) + sign * uj.outer_product(vi)) / ti.sqrt(2.0)
            value = (E * _times(H, E)).sum()
            if value < 0:
                for r in range(9):
                    for c in range(9):
                        result[r, c] -= value * E[r // 3, r % 3] * E[c // 3, c % 3]
    A = ti.Matrix.zero(float, 3, 3)
    for i in range(3):
        HE = _times(H, column(U, i).outer_product(column(V, i)))
        for j in range(3):
            A[i, j] = column(U, j).dot(HE @ column(V, j))
    A = (A + A.transpose()) / 2
    more = clamped(A) - A
    if more.norm_sqr() > 0:
        for r in range(9):
            for c in range(9):
                total = 0.0
                for i in range(3):
                    for j in range(3):
                        left = U[r // 3, i] * V[r % 3, i]
                        total += left * more[i, j] * U[c // 3, j] * V[c % 3, j]
                result[r, c] += total
    return result


@ti.func
def column(A, k):
    """Column k of a mat3, with k known when running."""
    return ti.Vector([A[0, k], A[1, k], A[2, k]])


def kinetic_energy(f: Callable[..., Any], serial: bool) -> Callable[..., None]:
    """Kernel of the kinetic energy of every tetrahedron."""

    @ti.kernel
    def kernel(v: vec3s, cells: index4, volume: scalars, rho: REAL, out: scalars):
        ti.loop_config(serialize=serial)
        for e in range(cells.shape[0]):
            t = cells[e]
            out[e] = f(v[t[0]], v[t[1]], v[t[2]], v[t[3]], volume[e], rho)

    return kernel


# Each function in a kernel of its own ------------------------------------------------------------------------------


def _deformation_gradient(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(x: vec3s, cells: index4, dphi: mat4x3s, F: mat3s):
        for e in range(F.shape[0]):
            t = cells[e]
            F[e] = f(x[t[0]], x[t[1]], x[t[2]], x[t[3]], dphi[e])

    return kernel


def _of_F(out_type: Any) -> Callable[[Callable[..., Any]], Callable[..., None]]:
    def make(f: Callable[..., Any]) -> Callable[..., None]:
        @ti.kernel
        def kernel(F: mat3s, C: REAL, D: REAL, out: out_type):
            for e in range(F.shape[0]):
                out[e] = f(F[e], C, D)

        return kernel

    return make


def _nodal_force(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(P: mat3s, dphi: mat4x3s, volume: scalars, out: vec3s):
        for row in range(out.shape[0]):
            e = row // 4
            out[row] = f(P[e], corner(dphi, e, row % 4), volume[e])

    return kernel


def _stiffness_block(f: Callable[..., Any]) -> Callable[..., None]:
    @ti.kernel
    def kernel(H: mat9s, dphi: mat4x3s, volume: scalars, out: mat3s):
        for row in range(out.shape[0]):
            e = row // 16
            out[row] = f(H[e], corner(dphi, e, (row % 16) // 4), corner(dphi, e, row % 4), volume[e])

    return kernel


#: How each function is called on all tetrahedra.
SINGLE: dict[str, Callable[[Callable[..., Any]], Callable[..., None]]] = {
    "deformation_gradient": _deformation_gradient,
    "psi": _of_F(scalars),
    "dpsi_dF": _of_F(mat3s),
    "d2psi_dF2": _of_F(mat9s),
    "nodal_force": _nodal_force,
    "stiffness_block": _stiffness_block,
}
