"""Ways to write `phi`, `dphi_dX`, `interpolate`: see the folder's `__init__`."""

import taichi as ti

# --- phi ---------------------------------------------------------------------------------------------------


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


# --- dphi_dX -----------------------------------------------------------------------------------------------


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


# --- interpolate -------------------------------------------------------------------------------------------


def interpolate(phi, x0, x1, x2, x3):
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2 + phi[3] * x3  # the sum of the weighted vertices


def interpolate__edges(phi, x0, x1, x2, x3):
    return (
        x0 + phi[1] * (x1 - x0) + phi[2] * (x2 - x0) + phi[3] * (x3 - x0)
    )  # the way from x0 along the edges
