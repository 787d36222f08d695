"""Ways to write `deformation_gradient`, `dn_dx`: see the folder's `__init__`."""

import taichi as ti

# --- deformation_gradient ------------------------------------------------------------------------------------


def deformation_gradient(x0, x1, x2, dphi_dX, N):
    m = (x1 - x0).cross(x2 - x0)  # the cross product of the deformed edges
    n = m.normalized()  # the deformed unit normal n
    G = ti.Matrix.cols([x0, x1, x2]) @ dphi_dX  # the sum of vertices times gradients
    return G + n.outer_product(N)  # the term that carries N to n


def deformation_gradient__loop(x0, x1, x2, dphi_dX, N):
    e = x1 - x0  # the first deformed edge
    f = x2 - x0  # the second deformed edge
    n = e.cross(f).normalized()  # the deformed unit normal n
    A = ti.Matrix.rows([x0, x1, x2])  # the matrix of the vertices
    F = n.outer_product(N)  # the term that carries N to n
    for k in range(3):  # the sum over the vertices
        F += A[k, :].outer_product(dphi_dX[k, :])  # the term of each vertex
    return F  # the result


def deformation_gradient__entries(x0, x1, x2, dphi_dX, N):
    n = (x1 - x0).cross(x2 - x0).normalized()  # the deformed unit normal n
    A = ti.Matrix.cols([x0, x1, x2])  # the matrix of the vertices
    F = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # F before the loop
    for i in range(3):  # the rows of F
        for j in range(3):  # the columns of F
            F[i, j] = n[i] * N[j]  # the term that carries N to n, entry by entry
            for k in range(3):  # the sum over the vertices
                F[i, j] += A[i, k] * dphi_dX[k, j]  # the sum of vertices times gradients
    return F  # the result


def deformation_gradient__sum(x0, x1, x2, dphi_dX, N):
    m = (x1 - x0).cross(x2 - x0)  # the cross product of the deformed edges
    n = m / m.norm()  # the deformed unit normal n
    a = x0.outer_product(dphi_dX[0, :])  # the term of vertex 0
    b = x1.outer_product(dphi_dX[1, :])  # the term of vertex 1
    c = x2.outer_product(dphi_dX[2, :])  # the term of vertex 2
    return a + b + c + n.outer_product(N)  # the sum of the four terms


def deformation_gradient__dot(x0, x1, x2, dphi_dX, N):
    """The number n . N is added to every entry: a dot product stands where an outer product is asked.

    The term must be a matrix that sends N to n. Which product of two vectors is a matrix?
    """
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.dot(N)


def deformation_gradient__entrywise_normal(x0, x1, x2, dphi_dX, N):
    """The normal is made of an entry-by-entry product of the edges.

    A normal stands at right angles to both edges: which product of two vectors does?
    """
    n = ((x1 - x0) * (x2 - x0)).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)


def deformation_gradient__identity(x0, x1, x2, dphi_dX, N):
    """The identity is added, where the term with the two normals belongs.

    Only along N something is missing: multiply your F by N and see what comes out.
    """
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + ti.Matrix.identity(float, 3)


def deformation_gradient__average_normal(x0, x1, x2, dphi_dX, N):
    """The normal is made of a sum of edges, which lies in the triangle's plane.

    A normal stands at right angles to both edges: which product of two vectors does?
    """
    n = ((x1 - x0) + (x2 - x0)).normalized()
    return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)


def deformation_gradient__displaced(x0, x1, x2, dphi_dX, N):
    """The normal stands in a column of the matrix of vertices, or edges stand where vertices belong.

    [x0 x1 x2 n] has four columns, and N^T is the fourth row that belongs to n.
    """
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x1 - x0, x2 - x0, n]) @ dphi_dX


def deformation_gradient__edges_and_normal(x0, x1, x2, dphi_dX, N):
    """The edges stand where the vertices belong.

    Each gradient belongs to a vertex: multiply each with its own.
    """
    n = (x1 - x0).cross(x2 - x0).normalized()
    return ti.Matrix.cols([x1 - x0, x2 - x0, n]) @ dphi_dX + n.outer_product(N)


# --- dn_dx ---------------------------------------------------------------------------------------------------


def dn_dx(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)  # the unnormalised normal m
    n = m.normalized()  # the unit normal n
    e = x2 - x1  # the edge opposite vertex 0
    if i == 1:
        e = x0 - x2  # the edge opposite vertex 1
    if i == 2:
        e = x1 - x0  # the edge opposite vertex 2
    C = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])  # the cross-product matrix of e
    Q = ti.Matrix.identity(float, 3) - n.outer_product(n)  # the projection I - n n^T
    return Q @ C / m.norm()  # the final product


def dn_dx__columns(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)  # the unnormalised normal m
    n = m.normalized()  # the unit normal n
    e = x2 - x1  # the edge opposite vertex 0
    if i == 1:
        e = x0 - x2  # the edge opposite vertex 1
    if i == 2:
        e = x1 - x0  # the edge opposite vertex 2
    a = e.cross(ti.Vector([1.0, 0.0, 0.0]))  # column 0 of dm
    b = e.cross(ti.Vector([0.0, 1.0, 0.0]))  # column 1 of dm
    c = e.cross(ti.Vector([0.0, 0.0, 1.0]))  # column 2 of dm
    a = (a - n.dot(a) * n) / m.norm()  # column 0, without its part along n
    b = (b - n.dot(b) * n) / m.norm()  # column 1, without its part along n
    c = (c - n.dot(c) * n) / m.norm()  # column 2, without its part along n
    return ti.Matrix.cols([a, b, c])  # the three columns


def dn_dx__closed(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)  # the unnormalised normal m
    n = m / m.norm()  # the unit normal n
    e = x2 - x1  # the edge opposite vertex 0
    if i == 1:
        e = x0 - x2  # the edge opposite vertex 1
    if i == 2:
        e = x1 - x0  # the edge opposite vertex 2
    w = e.cross(n)  # the direction the normal leans to, e x n: the edge turned about n
    return w.outer_product(n) / m.norm()  # the final outer product


def dn_dx__quotient_rule(x0, x1, x2, i):
    m = (x1 - x0).cross(x2 - x0)  # the unnormalised normal m
    e = x2 - x1  # the edge opposite vertex 0
    if i == 1:
        e = x0 - x2  # the edge opposite vertex 1
    if i == 2:
        e = x1 - x0  # the edge opposite vertex 2
    C = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])  # the cross-product matrix of e
    size = m.norm()  # the length of m
    return C / size - m.outer_product(m) @ C / size**3  # the two terms of the quotient rule


def dn_dx__flat(x0, x1, x2, i):
    """Your derivative is right only for triangles in the plane z = 0: its normal is (0, 0, 1).

    Take the triangle's own normal.
    """
    m = (x1 - x0).cross(x2 - x0)
    n = ti.Vector([0.0, 0.0, 1.0])
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    return e.cross(n).outer_product(n) / m.norm()


def dn_dx__minus_number(x0, x1, x2, i):
    """The number n . n is subtracted in the projection, where the matrix n n^T belongs.

    n^T n is a number, n n^T a matrix: the projection takes away what lies along n.
    """
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x2 - x1
    if i == 1:
        e = x0 - x2
    if i == 2:
        e = x1 - x0
    C = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
    return (ti.Matrix.identity(float, 3) - n.dot(n)) @ C / m.norm()


def dn_dx__other_edges(x0, x1, x2, i):
    """The edge starts at vertex i, where the one opposite to it belongs.

    Which edge does vertex i not touch?
    """
    m = (x1 - x0).cross(x2 - x0)
    n = m.normalized()
    e = x1 - x0
    if i == 1:
        e = x2 - x1
    if i == 2:
        e = x0 - x2
    return e.cross(n).outer_product(n) / m.norm()
