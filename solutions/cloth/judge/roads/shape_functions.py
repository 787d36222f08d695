"""Ways to write `phi`, `dphi_dX`, `interpolate`: see the folder's `__init__`."""

import taichi as ti

# --- phi -----------------------------------------------------------------------------------------------------


def phi(X, X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])  # the edge matrix D
    A = D.transpose() @ D  # the 2x2 matrix D^T D
    b = D.transpose() @ (X - X0)  # the right-hand side D^T (X - X0) of the 2x2 system
    p = A.inverse() @ b  # phi_1 and phi_2, the solution of the 2x2 system
    o = 1 - p[0] - p[1]  # phi_0, which makes the sum of all three one
    return ti.Vector([o, p[0], p[1]])  # the three components


def phi__by_hand(X, X0, X1, X2):
    e = X1 - X0  # the first edge
    f = X2 - X0  # the second edge
    d = X - X0  # the vector X - X0, from X0 to X
    a = e.dot(e)  # the entry [0, 0] of D^T D
    b = e.dot(f)  # the off-diagonal entry of D^T D
    c = f.dot(f)  # the entry [1, 1] of D^T D
    r = e.dot(d)  # the first entry of the right-hand side
    t = f.dot(d)  # the second entry of the right-hand side
    det = a * c - b * b  # the determinant of D^T D
    p = (c * r - b * t) / det  # phi_1, the first row of the 2x2 inverse
    q = (a * t - b * r) / det  # phi_2, the second row of the 2x2 inverse
    o = 1 - p - q  # phi_0, which makes the sum of all three one
    return ti.Vector([o, p, q])  # the three components


def phi__areas(X, X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)  # the normal of the whole triangle
    p = (X - X0).cross(X2 - X0)  # the area opposite vertex 1
    q = (X1 - X0).cross(X - X0)  # the area opposite vertex 2
    p = p.dot(m) / m.norm_sqr()  # the share of the area that is phi_1
    q = q.dot(m) / m.norm_sqr()  # the share of the area that is phi_2
    return ti.Vector([1 - p - q, p, q])  # the three components


def phi__three_areas(X, X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)  # the normal of the whole triangle
    n = m.normalized()  # the unit normal
    a = (X1 - X).cross(X2 - X).dot(n)  # the area opposite vertex 0
    b = (X2 - X).cross(X0 - X).dot(n)  # the area opposite vertex 1
    c = (X0 - X).cross(X1 - X).dot(n)  # the area opposite vertex 2
    return ti.Vector([a, b, c]) / m.norm()  # the shares of the whole area


def phi__gradients(X, X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)  # the normal of the whole triangle
    g = (X2 - X0).cross(m) / m.norm_sqr()  # the gradient of phi_1
    k = m.cross(X1 - X0) / m.norm_sqr()  # the gradient of phi_2
    p = g.dot(X - X0)  # phi_1
    q = k.dot(X - X0)  # phi_2
    return ti.Vector([1 - p - q, p, q])  # the three components


def phi__of_the_vertices(X, X0, X1, X2):
    """You solve with the 3x3 matrix of the vertices X0, X1, X2.

    It is singular as soon as the triangle's plane passes through the origin. Measure from a vertex instead: two
    edges, two unknowns.
    """
    return ti.Matrix.cols([X0, X1, X2]).inverse() @ X


def phi__of_the_vertices_as_rows(X, X0, X1, X2):
    """You solve with the 3x3 matrix of the vertices X0, X1, X2, and they stand in its rows.

    It is singular as soon as the triangle's plane passes through the origin. Measure from a vertex instead: two
    edges, two unknowns.
    """
    return ti.Matrix.rows([X0, X1, X2]).inverse() @ X


def phi__with_the_normal(X, X0, X1, X2):
    """You solve with a 3x3 matrix whose third column is no edge and no normal of the triangle.

    Two unknowns need two equations: multiply both sides with D^T.
    """
    A = ti.Matrix.cols([X1 - X0, X2 - X0, X0])
    p = A.inverse() @ (X - X0)
    return ti.Vector([1 - p[0] - p[1], p[0], p[1]])


def phi__flat_xy(X, X0, X1, X2):
    """Your phi is right only for triangles in the plane z = 0: the third coordinate is not used.

    Try a triangle that stands upright: the cloth lives in space. Three equations, two unknowns: least squares.
    """
    e, f, d = X1 - X0, X2 - X0, X - X0
    det = e[0] * f[1] - e[1] * f[0]
    p, q = (d[0] * f[1] - d[1] * f[0]) / det, (e[0] * d[1] - e[1] * d[0]) / det
    return ti.Vector([1 - p - q, p, q])


def phi__distances(X, X0, X1, X2):
    """Your phi are made of distances to the vertices.

    Shape functions are linear in X: shares of area, not of length.
    """
    a, b, c = (X - X0).norm(), (X - X1).norm(), (X - X2).norm()
    return ti.Vector([a, b, c]) / (a + b + c)


# --- dphi_dX -------------------------------------------------------------------------------------------------


def dphi_dX(X0, X1, X2):
    D = ti.Matrix.cols([X1 - X0, X2 - X0])  # the edge matrix D
    A = D.transpose() @ D  # the 2x2 matrix D^T D
    G = A.inverse() @ D.transpose()  # the 2x3 matrix of the gradients
    g = G[0, :]  # row 1, the gradient of phi_1
    k = G[1, :]  # row 2, the gradient of phi_2
    o = -g - k  # row 0, the gradient of phi_0
    return ti.Matrix.rows([o, g, k])  # the three rows


def dphi_dX__by_hand(X0, X1, X2):
    e = X1 - X0  # the first edge
    f = X2 - X0  # the second edge
    a = e.dot(e)  # the entry [0, 0] of D^T D
    b = e.dot(f)  # the off-diagonal entry of D^T D
    c = f.dot(f)  # the entry [1, 1] of D^T D
    det = a * c - b * b  # the determinant of D^T D
    g = (c * e - b * f) / det  # the gradient of phi_1, the first row of the 2x2 inverse
    k = (a * f - b * e) / det  # the gradient of phi_2, the second row of the 2x2 inverse
    o = -g - k  # row 0, the gradient of phi_0
    return ti.Matrix.rows([o, g, k])  # the three rows


def dphi_dX__turned_edges(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)  # the normal, as long as twice the area
    o = m.cross(X2 - X1)  # the turned edge opposite vertex 0
    g = m.cross(X0 - X2)  # the turned edge opposite vertex 1
    k = m.cross(X1 - X0)  # the turned edge opposite vertex 2
    return ti.Matrix.rows([o, g, k]) / m.norm_sqr()  # the three rows


def dphi_dX__unit_normal(X0, X1, X2):
    m = (X1 - X0).cross(X2 - X0)  # the normal, as long as twice the area
    n = m.normalized()  # the unit normal
    g = n.cross(X0 - X2) / m.norm()  # the gradient of phi_1
    k = n.cross(X1 - X0) / m.norm()  # the gradient of phi_2
    o = -g - k  # row 0, the gradient of phi_0
    return ti.Matrix.rows([o, g, k])  # the three rows


def dphi_dX__of_the_vertices(X0, X1, X2):
    """You invert the 3x3 matrix of the vertices X0, X1, X2.

    It is singular as soon as the triangle's plane passes through the origin, and it changes when the triangle is
    moved. Gradients come from edges.
    """
    return ti.Matrix.cols([X0, X1, X2]).inverse()


def dphi_dX__flat_xy(X0, X1, X2):
    """Your gradients are right only for triangles in the plane z = 0: the third coordinate is not used.

    Try a triangle that stands upright: the cloth lives in space.
    """
    e, f = X1 - X0, X2 - X0
    det = e[0] * f[1] - e[1] * f[0]
    g, k = ti.Vector([f[1], -f[0], 0.0]) / det, ti.Vector([-e[1], e[0], 0.0]) / det
    return ti.Matrix.rows([-g - k, g, k])


def dphi_dX__one_minus(X0, X1, X2):
    """Row 0 begins with 1: that is how phi_0 is made, not its gradient.

    The derivative of the constant 1 is zero. What do the three gradients sum to?
    """
    D = ti.Matrix.cols([X1 - X0, X2 - X0])
    G = (D.transpose() @ D).inverse() @ D.transpose()
    return ti.Matrix.rows([1 - G[0, :] - G[1, :], G[0, :], G[1, :]])


# --- interpolate ---------------------------------------------------------------------------------------------


def interpolate(phi, x0, x1, x2):
    return phi[0] * x0 + phi[1] * x1 + phi[2] * x2  # the weighted sum of the vertices


def interpolate__terms(phi, x0, x1, x2):
    a = phi[0] * x0  # the term of vertex 0
    b = phi[1] * x1  # the term of vertex 1
    c = phi[2] * x2  # the term of vertex 2
    return a + b + c  # the weighted sum of the vertices


def interpolate__matrix(phi, x0, x1, x2):
    return ti.Matrix.cols([x0, x1, x2]) @ phi  # the matrix of the vertices, as columns, times phi


def interpolate__loop(phi, x0, x1, x2):
    A = ti.Matrix.rows([x0, x1, x2])  # the matrix of the vertices
    x = ti.Vector([0.0, 0.0, 0.0])  # the point before the loop
    for i in range(3):  # the sum over the vertices
        x += phi[i] * A[i, :]  # the weighted sum of the vertices
    return x  # the result


def interpolate__edges(phi, x0, x1, x2):
    e = x1 - x0  # the first edge
    f = x2 - x0  # the second edge
    w = phi[0] + phi[1] + phi[2]  # the sum of the weights
    return w * x0 + phi[1] * e + phi[2] * f  # the sum of x0 and the weighted edges


def interpolate__vertex_and_edges_of_x1(phi, x0, x1, x2):
    """You begin at x1 and weight the edges from x0: base and edges do not belong together.

    Either weight the three vertices, or begin at the vertex the edges start from.
    """
    return x1 + phi[1] * (x1 - x0) + phi[2] * (x2 - x0)


def interpolate__chain(phi, x0, x1, x2):
    """You walk along the triangle: the second edge starts at x1.

    Either weight the three vertices, or take both edges from x0.
    """
    return x0 + phi[1] * (x1 - x0) + phi[2] * (x2 - x1)


def interpolate__one_more(phi, x0, x1, x2):
    """x0 comes in twice: once with its weight and once with factor one.

    The weights sum to one already: nothing is to be added.
    """
    return x0 + phi[0] * x0 + phi[1] * x1 + phi[2] * x2
