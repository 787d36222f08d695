"""Each student function in a kernel of its own, on all triangles: it can name what a kernel of many cannot."""

from collections.abc import Callable
from typing import Any

from muslin import given
from muslin.base.arrays import REAL, index3, mat3s, scalars, vec3s, vec4s
from muslin.base.engine import ti


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
