"""Ways to write each function: what the names of mistakes are made from.

Every function here is a road to one task, `<task>` or `<task>__<which road>`, in the notation of the task files.
`muslin.authoring.mutations` changes one thing in it at a time and notes what that makes of the public cases. The
comment of a line says what the line computes, in words that fit after "in"; it is all a student is told of it.
"""

import taichi as ti

# --- phi -----------------------------------------------------------------------------------------------------


def phi(X, X0, X1, X2, X3):
    E = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])  # the matrix of the edges
    p = E.inverse() @ (X - X0)  # the solution of the 3x3 system
    return ti.Vector([1 - p[0] - p[1] - p[2], p[0], p[1], p[2]])  # the four components


def phi__volumes(X, X0, X1, X2, X3):
    e = X1 - X0  # the first edge
    f = X2 - X0  # the second edge
    g = X3 - X0  # the third edge
    d = X - X0  # the vector from X0 to X
    whole = e.cross(f).dot(g)  # six times the volume
    p = f.cross(g).dot(d) / whole  # the share of the volume that is phi_1
    q = g.cross(e).dot(d) / whole  # the share of the volume that is phi_2
    r = e.cross(f).dot(d) / whole  # the share of the volume that is phi_3
    return ti.Vector([1 - p - q - r, p, q, r])  # the four components


# --- dphi_dX -------------------------------------------------------------------------------------------------


def dphi_dX(X0, X1, X2, X3):
    E = ti.Matrix.cols([X1 - X0, X2 - X0, X3 - X0])  # the matrix of the edges
    G = E.inverse()  # the inverse of the edge matrix
    a = G[0, :]  # the gradient of phi_1
    b = G[1, :]  # the gradient of phi_2
    c = G[2, :]  # the gradient of phi_3
    return ti.Matrix.rows([-a - b - c, a, b, c])  # the four rows


def dphi_dX__normals(X0, X1, X2, X3):
    e = X1 - X0  # the first edge
    f = X2 - X0  # the second edge
    g = X3 - X0  # the third edge
    whole = e.cross(f).dot(g)  # six times the volume
    a = f.cross(g) / whole  # the gradient of phi_1
    b = g.cross(e) / whole  # the gradient of phi_2
    c = e.cross(f) / whole  # the gradient of phi_3
    return ti.Matrix.rows([-a - b - c, a, b, c])  # the four rows


# --- interpolate ---------------------------------------------------------------------------------------------


def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2 + phi[3] * x3  # the sum of the weighted vertices


def interpolate__edges(phi, x0, x1, x2, x3):
    return (
        x0 + phi[1] * (x1 - x0) + phi[2] * (x2 - x0) + phi[3] * (x3 - x0)
    )  # the way from x0 along the edges


# --- deformation_gradient ------------------------------------------------------------------------------------


def deformation_gradient(x0, x1, x2, x3, dphi_dX):
    x = ti.Matrix.cols([x0, x1, x2, x3])  # the matrix of the vertices
    return x @ dphi_dX  # the product of vertices and gradients


def deformation_gradient__sum(x0, x1, x2, x3, dphi_dX):
    a = x0.outer_product(dphi_dX[0, :])  # the term of vertex 0
    b = x1.outer_product(dphi_dX[1, :])  # the term of vertex 1
    c = x2.outer_product(dphi_dX[2, :])  # the term of vertex 2
    d = x3.outer_product(dphi_dX[3, :])  # the term of vertex 3
    return a + b + c + d  # the sum of the terms


# --- mass_block ----------------------------------------------------------------------------------------------


def mass_block(i, j, volume, rho):
    m = rho * volume / 20  # the mass for i != j
    if i == j:  # the question whether both are one vertex
        m = rho * volume / 10  # the mass for i = j
    return m


def mass_block__delta(i, j, volume, rho):
    d = 0.0  # the delta
    if i == j:  # the question whether both are one vertex
        d = 1.0  # the delta for i = j
    return rho * volume / 20 * (1 + d)  # the mass


# --- kinetic_energy ------------------------------------------------------------------------------------------


def kinetic_energy(v0, v1, v2, v3, volume, rho):
    s = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)  # the squares
    p = v0.dot(v1) + v0.dot(v2) + v0.dot(v3) + v1.dot(v2) + v1.dot(v3) + v2.dot(v3)  # the mixed products
    return rho * volume / 20 * (s + p)  # the energy


def kinetic_energy__half(v0, v1, v2, v3, volume, rho):
    s = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)  # the squares
    v = v0 + v1 + v2 + v3  # the sum of the velocities
    p = v.dot(v) - s  # the mixed products, each twice
    return rho * volume / 2 * (s / 10 + p / 20)  # the energy


# --- psi -----------------------------------------------------------------------------------------------------


def psi(F, C, D):
    J = F.determinant()  # the change of volume
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    return C * (a * t - 3) + D * (J - 1) ** 2  # the energy


def psi__barred(F, C, D):
    J = F.determinant()  # the change of volume
    B = F * J ** (-1 / 3)  # F freed of its volume
    t = (B.transpose() @ B).trace()  # the barred invariant
    return C * (t - 3) + D * (J - 1) * (J - 1)  # the energy


# --- dpsi_dF -------------------------------------------------------------------------------------------------


def dpsi_dF(F, C, D):
    J = F.determinant()  # the change of volume
    G = F.inverse().transpose()  # the inverse transposed
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    A = 2 * C * a * (F - t / 3 * G)  # the stress of the change of shape
    B = 2 * D * (J - 1) * J * G  # the stress of the change of volume
    return A + B  # the sum of both stresses


def dpsi_dF__chain(F, C, D):
    J = F.determinant()  # the change of volume
    K = J * F.inverse().transpose()  # the derivative of J
    t = (F.transpose() @ F).trace()  # the invariant
    a = J ** (-2 / 3)  # the power of J
    b = -2 / 3 * J ** (-5 / 3)  # the derivative of the power of J
    A = C * (b * t * K + a * 2 * F)  # the stress of the change of shape
    B = D * 2 * (J - 1) * K  # the stress of the change of volume
    return A + B  # the sum of both stresses


# --- d2psi_dF2 -----------------------------------------------------------------------------------------------


def d2psi_dF2(F, C, D):
    J = F.determinant()  # the change of volume
    G = F.inverse().transpose()  # the inverse transposed
    t = (F.transpose() @ F).trace()  # the invariant
    c = 2 * C * J ** (-2 / 3)  # the factor of the change of shape
    d = 2 * D * J  # the factor of the change of volume
    H = ti.Matrix.zero(float, 9, 9)  # the empty matrix
    for i, j, m, n in ti.ndrange(3, 3, 3, 3):
        p = G[i, j] * G[m, n]  # the product of two entries of G
        q = G[i, n] * G[m, j]  # the change of G
        r = F[i, j] * G[m, n] + G[i, j] * F[m, n]  # the pair of mixed terms
        h = c * (t / 9 * (2 * p + 3 * q) - 2 / 3 * r)  # the terms of the change of shape
        v = d * ((2 * J - 1) * p - (J - 1) * q)  # the terms of the change of volume
        H[3 * i + j, 3 * m + n] = h + v  # the entry
        if i == m and j == n:  # the question whether both are one entry of F
            H[3 * i + j, 3 * m + n] += c  # the term of F itself
    return H


# --- stiffness_block -----------------------------------------------------------------------------------------


def stiffness_block(d2psi_dF2, grad_phi_i, grad_phi_j, volume):
    K = ti.Matrix.zero(float, 3, 3)  # the empty block
    for a, b, c, d in ti.ndrange(3, 3, 3, 3):
        h = d2psi_dF2[3 * a + c, 3 * b + d]  # the entry of the Hessian
        K[a, b] += volume * grad_phi_i[c] * h * grad_phi_j[d]  # the term of the sum
    return K


# --- nodal_force ---------------------------------------------------------------------------------------------


def nodal_force(P, grad_phi, volume):
    return -volume * (P @ grad_phi)  # the force


# --- spring_force --------------------------------------------------------------------------------------------


def spring_force(x0, x1, l0, k):
    d = x1 - x0  # the vector from x0 to x1
    n = d.norm()  # the length
    f = 0 * d  # the force where the ends meet
    if n > 0:  # the question whether the ends are apart
        f = k * (n - l0) * d / n  # the force
    return f


def spring_force__unit(x0, x1, l0, k):
    d = x1 - x0  # the vector from x0 to x1
    n = d.norm()  # the length
    u = 0 * d  # the direction where the ends meet
    if n > 0:  # the question whether the ends are apart
        u = d / n  # the direction
    return k * (n - l0) * u  # the force
