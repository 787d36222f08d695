"""The lecture's road to the Hessian: what the framework does around `d2psi_dFij` and `dn_dx`, on all triangles."""

from muslin import given
from muslin.base.arrays import REAL, index3, mat3s, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements import modes


@ti.func
def in_frame(dphi, V, i):
    """Gradient of phi_i in the frame (v_0, v_1)."""
    g = ti.Vector([dphi[i, 0], dphi[i, 1], dphi[i, 2]])
    return ti.Vector(
        [
            V[0, 0] * g[0] + V[1, 0] * g[1] + V[2, 0] * g[2],
            V[0, 1] * g[0] + V[1, 1] * g[1] + V[2, 1] * g[2],
        ]
    )


@ti.kernel
def svd(F: mat3s, N: vec3s, U: mat3s, s: vec3s, V: mat3s):
    """F = U diag(s) V^T of every triangle, its normal kept apart."""
    for e in range(F.shape[0]):
        U[e], s[e], V[e] = given.svd(F[e], N[e])


@ti.kernel
def split(s: vec3s, out: vec3s):
    """Stretches that are equal, split apart a little."""
    for e in range(s.shape[0]):
        out[e] = given.split(s[e])


@ti.kernel
def chain_rule(columns: mat3s, dn: mat3s, dphi: mat3s, N: vec3s, area: scalars, h: REAL, out: mat3s):
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
def clamp_known_modes(
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
            gi = in_frame(dphi[e], V[e], i)
            for j in range(3):
                gj = in_frame(dphi[e], V[e], j)
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
