"""The kernels of a step: all student functions a part of the cloth needs in one kernel, triangle by triangle."""

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from muslin import given
from muslin.base.arrays import REAL, index3, integers, mat3s, rows, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements import modes
from muslin.physics.elements.element import PARTS
from muslin.physics.elements.lecture import in_frame
from muslin.tasks.batch import kept

#: Gap of stretches below which the framework's own energies use their simplified flip.
NEARLY_EQUAL = 1e-3

#: The functions in it.
CALLED = ("deformation_gradient", "psi", "dpsi_ds", "dpsi_dF", "nodal_force", "d2psi_ds2", "eigensystem")


def fused(f: SimpleNamespace, able: int, serial: bool) -> Callable[..., None]:
    """Kernel of some parts, kept for as long as the functions are.

    Parameters
    ----------
    f : namespace
        The functions of `CALLED`, and `flip`: the framework's own for its own energies, else None.
    able : int
        Parts that can be computed, as bits; the first entry of the kernel's `orders` chooses among them, the
        second says whether to project, and the third answers: 1 if a result is not finite.
    serial : bool
        Whether one thread is as fast.
    """
    functions = tuple(getattr(f, name) for name in CALLED)
    key = ("fused", able, serial, f.flip, functions)
    made: Callable[..., None] = kept(f.deformation_gradient, key, lambda: _kernel(f, able, serial))
    return made


def _kernel(f: SimpleNamespace, able: int, serial: bool) -> Callable[..., None]:
    deformation_gradient, dpsi_ds = f.deformation_gradient, f.dpsi_ds
    energy_of, gradient_of, hessian_of = _energy(f), _gradient(f), _hessian(f)
    energies, gradients, hessians = (bool(able & bit) for bit in PARTS.values())

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
            if ti.static(energies):  # noqa: SIM102 (known when compiling, and when running)
                if orders[0] & 1:
                    energy[e] = h * area[e] * energy_of(s, mu, lam)
                    seen += energy[e]
            if ti.static(gradients or hessians):  # noqa: SIM102
                if orders[0] & 6:
                    p = dpsi_ds(s, mu, lam)
            if ti.static(gradients):  # noqa: SIM102
                if orders[0] & 2:
                    seen += gradient_of(e, U, p, V, dphi, area[e], h, gradient)
            if ti.static(hessians):  # noqa: SIM102
                if orders[0] & 4:
                    seen += hessian_of(e, U, s, p, V, B, mu, lam, h * area[e], orders[1], row)
            if not (ti.abs(seen) < ti.math.inf) or (x1 - x0).cross(x2 - x0).norm_sqr() == 0:
                orders[2] = 1

    return kernel


def _energy(f: SimpleNamespace) -> Any:
    psi = f.psi

    @ti.func
    def energy_of(s, mu, lam):
        return psi(s, mu, lam)

    return energy_of


def _gradient(f: SimpleNamespace) -> Any:
    dpsi_dF, nodal_force = f.dpsi_dF, f.nodal_force

    @ti.func
    def gradient_of(e, U, p, V, dphi: ti.template(), area, h, gradient: ti.template()):
        """Minus the force on each corner of triangle e; returns something of all of them."""
        P = ti.Matrix.zero(float, 3, 3)
        P = dpsi_dF(U, p, V)
        seen = 0.0
        for i in range(3):
            force = ti.Vector([0.0, 0.0, 0.0])
            force = nodal_force(P, ti.Vector([dphi[e][i, 0], dphi[e][i, 1], dphi[e][i, 2]]), area, h)
            gradient[3 * e + i] = -force
            seen += force.sum()
        return seen

    return gradient_of


def _hessian(f: SimpleNamespace) -> Any:
    d2psi_ds2, eigensystem, known_flip = f.d2psi_ds2, f.eigensystem, f.flip
    flips = known_flip is not None

    @ti.func
    def hessian_of(e, U, s, p, V, B, mu, lam, weight, project, row: ti.template()):
        """The modes of triangle e; returns something of all of them."""
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
        g0, g1, g2 = in_frame(B, V, 0), in_frame(B, V, 1), in_frame(B, V, 2)
        modes.store(row, e, U, g0, g1, g2, stretch, flip, q[1], q[2], q[3], weight, project)
        return H.sum() + q.sum()

    return hessian_of


def kinetic_energy(f: Callable[..., Any], serial: bool) -> Callable[..., None]:
    """Kernel of the student's kinetic energy on all triangles."""

    @ti.kernel
    def kernel(v: vec3s, triangles: index3, area: scalars, rho: REAL, h: REAL, out: scalars):
        ti.loop_config(serialize=serial)
        for e in range(triangles.shape[0]):
            t = triangles[e]
            out[e] = f(v[t[0]], v[t[1]], v[t[2]], area[e], rho, h)

    return kernel
