"""The kernel of the framework's own tetrahedron, one for each strain energy."""

import functools

from muslin.base.arrays import REAL, index4, integers, mat3s, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements.decompose import clamped, signed_svd
from muslin.physics.elements.laws import LAWS


@functools.cache
def native(name: str, serial: bool):
    """Kernel of a law; its `orders` choose among parts, as bits, and then whether to project.

    The third answers: 1 if a tetrahedron is inverted where the law does not allow that.
    """
    energy_of, stress_of, modes_of, bounded = LAWS[name]

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
            if ti.static(bounded):  # noqa: SIM102
                if not F.determinant() > 0:
                    orders[2] = 1
            if orders[0] & 1:
                energy[e] = volume[e] * energy_of(F, a, b)
            if orders[0] & 2:
                P = volume[e] * stress_of(F, a, b)
                for k in range(4):
                    gradient[4 * e + k] = P @ g[4 * e + k]
            if orders[0] & 4:
                U, s, V = signed_svd(F)
                diagonal, off, flip, twist = modes_of(s, a, b)
                A = ti.Matrix(
                    [
                        [diagonal[0], off[2], off[1]],
                        [off[2], diagonal[1], off[0]],
                        [off[1], off[0], diagonal[2]],
                    ]
                )
                if orders[1] == 1:
                    A = clamped(A)
                    flip, twist = ti.max(flip, 0.0), ti.max(twist, 0.0)
                A *= volume[e]
                same, cross = volume[e] / 2 * (flip + twist), volume[e] / 2 * (flip - twist)
                for i in range(4):
                    gi = V.transpose() @ g[4 * e + i]
                    for j in range(i, 4):
                        gj = V.transpose() @ g[4 * e + j]
                        B = ti.Matrix.zero(float, 3, 3)
                        for p in ti.static(range(3)):
                            q, r = (p + 1) % 3, (p + 2) % 3
                            B[p, p] = (
                                A[p, p] * gi[p] * gj[p] + same[r] * gi[q] * gj[q] + same[q] * gi[r] * gj[r]
                            )
                            B[p, q] = A[p, q] * gi[p] * gj[q] + cross[r] * gi[q] * gj[p]
                            B[q, p] = A[q, p] * gi[q] * gj[p] + cross[r] * gi[p] * gj[q]
                        K = U @ B @ U.transpose()
                        blocks[16 * e + 4 * j + i] = K.transpose()
                        blocks[16 * e + 4 * i + j] = K

    return kernel
