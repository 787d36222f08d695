"""The kernel of the framework's own tetrahedron, one for each strain energy."""

import functools

from muslin.base.arrays import REAL, index4, integers, mat3s, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements.decompose import clamped, signed_svd
from muslin.physics.elements.laws import LAWS, cofactor


def _framed(modes_of):
    @ti.func
    def framed(e, F, a, b, volume, project, g: ti.template(), blocks: ti.template()):
        """The Hessian of cell e from its modes; with `project` made positive semi-definite."""
        U, s, V = signed_svd(F)
        diagonal, off, flip, twist = modes_of(s, a, b)
        A = ti.Matrix(
            [
                [diagonal[0], off[2], off[1]],
                [off[2], diagonal[1], off[0]],
                [off[1], off[0], diagonal[2]],
            ]
        )
        if project == 1:
            A = clamped(A)
            flip, twist = ti.max(flip, 0.0), ti.max(twist, 0.0)
        A *= volume
        same, cross = volume / 2 * (flip + twist), volume / 2 * (flip - twist)
        for i in range(4):
            gi = V.transpose() @ g[4 * e + i]
            for j in range(i, 4):
                gj = V.transpose() @ g[4 * e + j]
                B = ti.Matrix.zero(float, 3, 3)
                for p in ti.static(range(3)):
                    q, r = (p + 1) % 3, (p + 2) % 3
                    B[p, p] = A[p, p] * gi[p] * gj[p] + same[r] * gi[q] * gj[q] + same[q] * gi[r] * gj[r]
                    B[p, q] = A[p, q] * gi[p] * gj[q] + cross[r] * gi[q] * gj[p]
                    B[q, p] = A[q, p] * gi[q] * gj[p] + cross[r] * gi[p] * gj[q]
                K = U @ B @ U.transpose()
                blocks[16 * e + 4 * j + i] = K.transpose()
                blocks[16 * e + 4 * i + j] = K

    return framed


def _direct(derivatives_of):
    @ti.func
    def direct(e, F, a, b, volume, g: ti.template(), blocks: ti.template()):
        """The Hessian of cell e as it is, of a law of I = |F|^2 and J = det F, with f_i = F g_i and c_i = dJ/dx_i::

        K_ij = 2 psi_I (g_i . g_j) 1 + 2 f_i (2 psi_II f_j + psi_IJ c_j)^T + c_i (2 psi_IJ f_j + psi_JJ c_j)^T
               - psi_J [F (g_i x g_j)]_x
        """
        d_I, d_J, d_II, d_IJ, d_JJ = derivatives_of(F.norm_sqr(), F.determinant(), a, b)
        G = cofactor(F)
        for i in range(4):
            gi = g[4 * e + i]
            fi, ci = volume * (F @ gi), volume * (G @ gi)
            for j in range(i, 4):
                gj = g[4 * e + j]
                fj, cj = F @ gj, G @ gj
                h, same = volume * d_J * (F @ gi.cross(gj)), 2 * volume * d_I * gi.dot(gj)
                K = (2 * fi).outer_product(2 * d_II * fj + d_IJ * cj)
                K += ci.outer_product(2 * d_IJ * fj + d_JJ * cj)
                K += ti.Matrix([[same, h[2], -h[1]], [-h[2], same, h[0]], [h[1], -h[0], same]])
                blocks[16 * e + 4 * j + i] = K.transpose()
                blocks[16 * e + 4 * i + j] = K

    return direct


@functools.cache
def native(name: str, serial: bool):
    """Kernel of a law; its `orders` choose among parts, as bits, and then whether to project.

    The third answers: 1 if a tetrahedron is inverted where the law does not allow that.
    """
    energy_of, stress_of, modes_of, bounded, derivatives_of = LAWS[name]
    framed, direct = _framed(modes_of), _direct(derivatives_of)
    simple = derivatives_of is not None

    @ti.kernel
    def kernel(
        orders: integers,
        x: vec3s,
        cells: index4,
        g: vec3s,
        volume: scalars,
        a: REAL,
        b: REAL,
        energy: scalars,
        gradient: vec3s,
        blocks: mat3s,
    ):
        ti.loop_config(serialize=serial)
        for e in range(cells.shape[0]):
            t = cells[e]
            F = ti.Matrix.zero(float, 3, 3)
            for k in ti.static(range(1, 4)):
                F += (x[t[k]] - x[t[0]]).outer_product(g[4 * e + k])
            I, J = F.norm_sqr(), F.determinant()  # noqa: E741
            if ti.static(bounded):  # noqa: SIM102
                if not J > 0:
                    orders[2] = 1
            if orders[0] & 1:
                energy[e] = volume[e] * energy_of(F, I, J, a, b)
            if orders[0] & 2:
                P = volume[e] * stress_of(F, I, J, a, b)
                for k in range(4):
                    gradient[4 * e + k] = P @ g[4 * e + k]
            if orders[0] & 4:
                if ti.static(simple):
                    if orders[1] == 1:
                        framed(e, F, a, b, volume[e], orders[1], g, blocks)
                    else:
                        direct(e, F, a, b, volume[e], g, blocks)
                else:
                    framed(e, F, a, b, volume[e], orders[1], g, blocks)

    return kernel
