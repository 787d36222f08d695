"""Ways to write each function, and known detours: what the names of mistakes are made from.

Every function here is a road to one task, `<task>` or `<task>__<which road>`, in the notation of the task files.
`muslin.authoring.mutations` changes one thing in it at a time and notes what that makes of the public cases. The
comment of a line says what the line computes, in words that fit after "in"; it is all a student is told of it.

A function whose docstring has two paragraphs is no road but a mistake as a whole: what to say, and one next step.
"""

import taichi as ti

from muslin.given import diag

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


# --- mass_block ----------------------------------------------------------------------------------------------


def mass_block(i, j, area, rho, h):
    m = rho * h * area / 12  # the mass off the diagonal, for i != j
    if i == j:
        m = rho * h * area / 6  # the mass on the diagonal, for i = j
    return m  # the result


def mass_block__kronecker(i, j, area, rho, h):
    d = 0  # delta_ij off the diagonal
    if i == j:
        d = 1  # delta_ij on the diagonal, where i = j
    return rho * h * area * (1 + d) / 12  # the mass, from 1 + delta_ij: 2 on the diagonal, 1 off the diagonal


def mass_block__from_the_diagonal(i, j, area, rho, h):
    m = rho * h * area / 6  # the mass on the diagonal, for i = j
    if i != j:
        m = m / 2  # the mass off the diagonal, for i != j
    return m  # the result


def mass_block__fraction(i, j, area, rho, h):
    f = 1 / 12  # the fraction off the diagonal, for i != j
    if i == j:
        f = 1 / 6  # the fraction on the diagonal, for i = j
    return f * rho * h * area  # the result


def mass_block__integral(i, j, area, rho, h):
    q = area / 12  # the integral of phi_i phi_j off the diagonal, for i != j
    if i == j:
        q = area / 6  # the integral of phi_i phi_j on the diagonal, for i = j
    return rho * h * q  # the result


def mass_block__neighbours(i, j, area, rho, h):
    """The blocks of the vertices 0 and 2 are taken as not coupled.

    No vertex is special: every pair of vertices shares the triangle.
    """
    m = rho * h * area / 12
    if i == j:
        m = rho * h * area / 6
    if abs(i - j) == 2:
        m = 0.0
    return m


def mass_block__tetrahedron(i, j, area, rho, h):
    """1/10 and 1/20 are the fractions of a tetrahedron.

    Integrate over the triangle: u from 0 to 1, w from 0 to 1 - u.
    """
    m = rho * h * area / 20
    if i == j:
        m = rho * h * area / 10
    return m


# --- kinetic_energy ------------------------------------------------------------------------------------------


def kinetic_energy(v0, v1, v2, area, rho, h):
    a = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)  # the squares v_i . v_i, of the diagonal
    b = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)  # the mixed terms v_i . v_j, off the diagonal
    return rho * h * area / 12 * (a + b)  # the sum and its factor


def kinetic_energy__loops(v0, v1, v2, area, rho, h):
    v = ti.Matrix.rows([v0, v1, v2])  # the matrix of the velocities
    T = 0.0  # the energy before the loop
    for i in range(3):  # the sum over i
        for j in range(3):  # the sum over j
            m = rho * h * area / 12  # the mass off the diagonal, for i != j
            if i == j:
                m = rho * h * area / 6  # the mass on the diagonal, for i = j
            T += 0.5 * m * v[i, :].dot(v[j, :])  # the double sum, term by term
    return T  # the result


def kinetic_energy__of_the_sum(v0, v1, v2, area, rho, h):
    w = v0 + v1 + v2  # the sum of the three velocities
    a = v0.norm_sqr() + v1.norm_sqr() + v2.norm_sqr()  # the squares v_i . v_i, of the diagonal
    return rho * h * area / 24 * (a + w.norm_sqr())  # the sum of squares and the square of the sum


def kinetic_energy__six_terms(v0, v1, v2, area, rho, h):
    m = rho * h * area / 6  # the mass on the diagonal
    k = rho * h * area / 12  # the mass off the diagonal
    a = 0.5 * m * v0.dot(v0) + 0.5 * m * v1.dot(v1) + 0.5 * m * v2.dot(v2)  # the squares v_i . v_i, of the diagonal
    b = k * v0.dot(v1) + k * v1.dot(v2) + k * v0.dot(v2)  # the mixed terms v_i . v_j, i < j
    return a + b  # the sum of squares and mixed terms


def kinetic_energy__matrix(v0, v1, v2, area, rho, h):
    m = rho * h * area / 12  # the mass off the diagonal
    a = 2 * m * v0 + m * v1 + m * v2  # row 0 of M_e times the velocities
    b = m * v0 + 2 * m * v1 + m * v2  # row 1 of M_e times the velocities
    c = m * v0 + m * v1 + 2 * m * v2  # row 2 of M_e times the velocities
    return 0.5 * (v0.dot(a) + v1.dot(b) + v2.dot(c))  # the sum and its factor 1/2


def kinetic_energy__fractions(v0, v1, v2, area, rho, h):
    a = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)  # the squares v_i . v_i, of the diagonal
    b = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)  # the mixed terms v_i . v_j, off the diagonal
    M = rho * h * area  # the mass of the triangle
    return 0.5 * M * (a / 6 + 2 * b / 12)  # the sum of squares and mixed terms


def kinetic_energy__norms(v0, v1, v2, area, rho, h):
    """The lengths of the velocities are summed, not their squares.

    Kinetic energy is quadratic: doubling every velocity must give four times as much.
    """
    return rho * h * area / 12 * (v0.norm() + v1.norm() + v2.norm())


def kinetic_energy__norms_and_pairs(v0, v1, v2, area, rho, h):
    """The lengths of the velocities stand where their squares belong.

    Kinetic energy is quadratic: doubling every velocity must give four times as much.
    """
    return rho * h * area / 12 * (v0.norm() + v1.norm() + v2.norm() + v0.dot(v1) + v1.dot(v2) + v2.dot(v0))


def kinetic_energy__crossed(v0, v1, v2, area, rho, h):
    """The mixed terms are lengths of cross products.

    Mixed terms are dot products: they are largest where the velocities are parallel.
    """
    b = v0.cross(v1).norm() + v1.cross(v2).norm() + v2.cross(v0).norm()
    return rho * h * area / 12 * (v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + b)


def kinetic_energy__of_the_sum_of_norms(v0, v1, v2, area, rho, h):
    """The mixed terms are products of lengths, without the angle between the velocities.

    The mixed term of two velocities is their dot product.
    """
    a, b, c = v0.norm(), v1.norm(), v2.norm()
    return rho * h * area / 12 * (a * a + b * b + c * c + a * b + b * c + c * a)


# --- right_cauchy_green --------------------------------------------------------------------------------------


def right_cauchy_green(F):
    return F.transpose() @ F  # C


def right_cauchy_green__loops(F):
    C = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # C before the loop
    for i in range(3):  # the rows of C
        for j in range(3):  # the columns of C
            for k in range(3):  # the inner sum over the three rows of F
                C[i, j] += F[k, i] * F[k, j]  # each entry of C
    return C  # the result


def right_cauchy_green__columns(F):
    a = F[:, 0]  # column 0 of F
    b = F[:, 1]  # column 1 of F
    c = F[:, 2]  # column 2 of F
    p = ti.Vector([a.dot(a), a.dot(b), a.dot(c)])  # row 0 of C
    q = ti.Vector([b.dot(a), b.dot(b), b.dot(c)])  # row 1 of C
    t = ti.Vector([c.dot(a), c.dot(b), c.dot(c)])  # row 2 of C
    return ti.Matrix.rows([p, q, t])  # the three rows


def right_cauchy_green__dyads(F):
    C = F[0, :].outer_product(F[0, :])  # the part of row 0 of F
    C += F[1, :].outer_product(F[1, :])  # the part of row 1 of F
    C += F[2, :].outer_product(F[2, :])  # the part of row 2 of F
    return C  # the sum over the three rows of F


def right_cauchy_green__twice(F):
    """F^T F is multiplied with itself: its eigenvalues are fourth powers of the stretches.

    C is F^T F itself.
    """
    return F.transpose() @ F @ F.transpose() @ F


def right_cauchy_green__both_transposed(F):
    """Both factors are transposed.

    Put dx = F dX into dx^T dx: only the first factor is transposed.
    """
    return F.transpose() @ F.transpose()


def right_cauchy_green__inverse(F):
    """An inverse stands where a transpose belongs.

    The inverse is the transpose for rotations only.
    """
    return F.inverse() @ F.transpose()


def right_cauchy_green__inverse_transposed(F):
    """The inverse of F takes part: an inverse stands where there should be none.

    Put dx = F dX into dx^T dx: nothing is inverted.
    """
    return F.inverse().transpose() @ F


def right_cauchy_green__stretch_squared(F):
    """This is half of F^T F + F F^T: the left and the right tensor are mixed.

    Put dx = F dX into dx^T dx: the order is fixed, and the result is symmetric already.
    """
    return (F.transpose() @ F + F @ F.transpose()) / 2


def right_cauchy_green__one_row(F):
    """Only one row of F takes part.

    Every row of F changes lengths: C sums over all three.
    """
    return F[0, :].outer_product(F[0, :])


def right_cauchy_green__cofactor(F):
    """F^T F is divided or multiplied by det F.

    C needs no determinant: put dx = F dX into dx^T dx.
    """
    return F.transpose() @ F / F.determinant()


# --- psi -----------------------------------------------------------------------------------------------------


def psi(s, mu, lam):
    a = (s[0] - 1) ** 2 + (s[1] - 1) ** 2  # the sum of squares that mu weighs
    t = s[0] + s[1] - 2  # the change of size that lam weighs
    return mu * a + lam / 2 * t**2  # the sum of the mu term and the lam term


def psi__strains(s, mu, lam):
    a = s[0] - 1  # the strain of direction 0
    b = s[1] - 1  # the strain of direction 1
    return mu * (a**2 + b**2) + lam / 2 * (a + b) ** 2  # the sum of the mu term and the lam term


def psi__loop(s, mu, lam):
    a = 0.0  # the sum of squares that mu weighs
    t = 0.0  # the change of size that lam weighs
    for i in range(2):  # the sum over the stretches in the plane
        a += (s[i] - 1) ** 2  # the sum of squares that mu weighs
        t += s[i] - 1  # the change of size that lam weighs
    return mu * a + 0.5 * lam * t * t  # the sum of the mu term and the lam term


def psi__one_line(s, mu, lam):
    a = mu * (s[0] - 1) ** 2 + mu * (s[1] - 1) ** 2  # the mu term
    b = 0.5 * lam * (s[0] + s[1] - 2) ** 2  # the lam term
    return a + b  # the sum of the mu term and the lam term


def psi__brackets(s, mu, lam):
    """mu multiplies only the first of its two squares.

    Put the sum of both squares in brackets: mu weighs each of them.
    """
    return mu * (s[0] - 1) ** 2 + (s[1] - 1) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2


def psi__difference(s, mu, lam):
    """The lam term counts the difference of the stretches, not the sum of their changes.

    What changes the size of a square: both sides longer, or one longer and the other shorter?
    """
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] - s[1]) ** 2


def psi__one_over(s, mu, lam):
    """lam stands below the fraction line.

    lam/2, or 0.5 * lam: a larger lam must store more.
    """
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + 1 / (2 * lam) * (s[0] + s[1] - 2) ** 2


def psi__logarithm(s, mu, lam):
    """The stretches come in by their logarithms: that is another material, Hencky's.

    The energy counts s - 1.
    """
    a, b = ti.log(s[0]), ti.log(s[1])
    return mu * (a * a + b * b) + lam / 2 * (a + b) ** 2


def psi__green(s, mu, lam):
    """The energy counts (s^2 - 1)/2, Green's strain: that is another material, St. Venant-Kirchhoff.

    The energy counts s - 1.
    """
    a, b = (s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2
    return mu * (a * a + b * b) + lam / 2 * (a + b) ** 2


# --- dpsi_ds -------------------------------------------------------------------------------------------------


def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)  # the lam term
    p = 2 * mu * (s[0] - 1) + t  # component 0
    q = 2 * mu * (s[1] - 1) + t  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__strains(s, mu, lam):
    a = s[0] - 1  # the strain of direction 0
    b = s[1] - 1  # the strain of direction 1
    p = 2 * mu * a + lam * (a + b)  # component 0
    q = 2 * mu * b + lam * (a + b)  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__loop(s, mu, lam):
    t = s[0] + s[1] - 2  # the change of size that lam weighs, the sum of both strains
    g = ti.Vector([0.0, 0.0, 0.0])  # the gradient before the loop
    for i in range(2):  # the components in the plane
        g[i] = 2 * mu * (s[i] - 1) + lam * t  # each component
    return g  # the three components


def dpsi_ds__sum_in_a_loop(s, mu, lam):
    g = ti.Vector([0.0, 0.0, 0.0])  # the gradient before the loop
    for i in range(2):  # the components in the plane
        g[i] += 2 * mu * (s[i] - 1)  # the mu term of each component
        for j in range(2):  # the sum of both strains, that couples the components
            g[i] += lam * (s[j] - 1)  # the lam term of each component
    return g  # the three components


def dpsi_ds__one_line(s, mu, lam):
    p = 2 * mu * (s[0] - 1) + lam * (s[0] + s[1] - 2)  # component 0
    q = 2 * mu * (s[1] - 1) + lam * (s[0] + s[1] - 2)  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__terms(s, mu, lam):
    a = 2 * mu * (s[0] - 1)  # the mu term of component 0
    b = 2 * mu * (s[1] - 1)  # the mu term of component 1
    t = lam * (s[0] + s[1] - 2)  # the lam term, with the sum of both stretches
    return ti.Vector([a + t, b + t, 0.0])  # the three components


def dpsi_ds__sum_of_all(s, mu, lam):
    """The third component carries the derivative of a third stretch.

    psi does not contain s_2: what is its derivative by it?
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 2 * mu * (s[2] - 1) + t])


def dpsi_ds__third_lam(s, mu, lam):
    """The third component carries the lam term.

    psi does not contain s_2: what is its derivative by it?
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, t])


def dpsi_ds__half_lam_sum(s, mu, lam):
    """The brackets are missing: 1 is subtracted from 2 mu s_i, not from s_i.

    2 mu multiplies s_i - 1 as a whole.
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * s[0] - 1 + t, 2 * mu * s[1] - 1 + t, 0.0])


def dpsi_ds__area_without_chain(s, mu, lam):
    """The lam term holds the product of the stretches: that is the area energy, and its chain rule is missing.

    Differentiate the linearised energy: the lam term is the square of a sum.
    """
    t = lam * (s[0] * s[1] - 1)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])


# --- d2psi_ds2 -----------------------------------------------------------------------------------------------


def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam  # the entries on the diagonal
    b = lam  # the entries off the diagonal
    return ti.Matrix([[a, b, 0.0], [b, a, 0.0], [0.0, 0.0, 0.0]])  # the nine entries


def d2psi_ds2__dyad(s, mu, lam):
    e = ti.Vector([1.0, 1.0, 0.0])  # the vector (1, 1, 0)
    A = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])  # the identity of the plane
    return 2 * mu * A + lam * e.outer_product(e)  # the sum of the mu part and the lam part


def d2psi_ds2__loop(s, mu, lam):
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the matrix before the loop
    for i in range(2):  # the rows
        for j in range(2):  # the columns
            H[i, j] += lam  # the lam part, on and off the diagonal
        H[i, i] += 2 * mu  # the mu part on the diagonal
    return H  # the nine entries


def d2psi_ds2__condition(s, mu, lam):
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the matrix before the loop
    for i in range(2):  # the rows
        for j in range(2):  # the columns
            H[i, j] = lam  # the entries off the diagonal
            if i == j:
                H[i, j] = 2 * mu + lam  # the entries on the diagonal
    return H  # the nine entries


def d2psi_ds2__entries(s, mu, lam):
    H = [[2 * mu + lam, lam, 0.0], [lam, 2 * mu + lam, 0.0], [0.0, 0.0, 0.0]]  # the nine entries
    return ti.Matrix(H)  # the result


def d2psi_ds2__mu_and_lam(s, mu, lam):
    """The factor 2 of mu has been applied to lam, too.

    The mu term and the lam term come from different squares: differentiate each by itself.
    """
    a = 2 * (mu + lam)
    return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])


def d2psi_ds2__mu_and_lam_everywhere(s, mu, lam):
    """The factor 2 of mu has been applied to lam, too.

    The mu term and the lam term come from different squares: differentiate each by itself.
    """
    a, b = 2 * (mu + lam), 2 * lam
    return ti.Matrix([[a, b, 0.0], [b, a, 0.0], [0.0, 0.0, 0.0]])


# --- dpsi_dF -------------------------------------------------------------------------------------------------


def dpsi_dF(U, dpsi_ds, V):
    return U @ diag(dpsi_ds) @ V.transpose()  # the product of three matrices


def dpsi_dF__loop(U, dpsi_ds, V):
    P = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # P before the loop
    for k in range(3):  # the sum over the directions
        P += dpsi_ds[k] * U[:, k].outer_product(V[:, k])  # the term of each direction
    return P  # the sum over the directions


def dpsi_dF__loops(U, dpsi_ds, V):
    P = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # P before the loop
    for i in range(3):  # the rows of P
        for j in range(3):  # the columns of P
            for k in range(3):  # the sum over the directions
                P[i, j] += U[i, k] * dpsi_ds[k] * V[j, k]  # each entry, term by term
    return P  # the result


def dpsi_dF__entries(U, dpsi_ds, V):
    p = dpsi_ds  # the stresses
    S = ti.Matrix([[p[0], 0.0, 0.0], [0.0, p[1], 0.0], [0.0, 0.0, p[2]]])  # the diagonal matrix of dpsi_ds
    return U @ S @ V.transpose()  # the product of three matrices


def dpsi_dF__sum(U, dpsi_ds, V):
    a = dpsi_ds[0] * U[:, 0].outer_product(V[:, 0])  # the term of direction 0
    b = dpsi_ds[1] * U[:, 1].outer_product(V[:, 1])  # the term of direction 1
    c = dpsi_ds[2] * U[:, 2].outer_product(V[:, 2])  # the term of direction 2
    return a + b + c  # the sum over the three directions


def dpsi_dF__rows(U, dpsi_ds, V):
    """The rows of U and V are used, where the principal directions are their columns.

    u_i is column i: U[:, i].
    """
    a = dpsi_ds[0] * U[0, :].outer_product(V[0, :])
    b = dpsi_ds[1] * U[1, :].outer_product(V[1, :])
    return a + b + dpsi_ds[2] * U[2, :].outer_product(V[2, :])


def dpsi_dF__of_the_vectors(U, dpsi_ds, V):
    """U and V are multiplied with the vector dpsi_ds each, and both come together in an outer product.

    Each component of dpsi_ds belongs to one pair of columns: a diagonal matrix between U and V^T.
    """
    return (U @ dpsi_ds).outer_product(V @ dpsi_ds)


def dpsi_dF__dyad(U, dpsi_ds, V):
    """A full matrix of dpsi_ds with itself stands in the middle, where a diagonal one belongs.

    The stress in the principal directions is diagonal.
    """
    return U @ dpsi_ds.outer_product(dpsi_ds) @ V.transpose()


def dpsi_dF__entrywise(U, dpsi_ds, V):
    """The matrices are multiplied entry by entry.

    In Taichi * is entry by entry. The matrix product has another sign.
    """
    return U @ diag(dpsi_ds) * V.transpose()


# --- nodal_force ---------------------------------------------------------------------------------------------


def nodal_force(P, grad_phi, area, h):
    return -h * area * (P @ grad_phi)  # the force


def nodal_force__volume(P, grad_phi, area, h):
    w = h * area  # the volume of the triangle
    f = P @ grad_phi  # the product of P and the gradient
    return -w * f  # the force, minus the gradient of the energy


def nodal_force__components(P, grad_phi, area, h):
    a = P[0, :].dot(grad_phi)  # component 0, row 0 of P times the gradient
    b = P[1, :].dot(grad_phi)  # component 1, row 1 of P times the gradient
    c = P[2, :].dot(grad_phi)  # component 2, row 2 of P times the gradient
    return -h * area * ti.Vector([a, b, c])  # the three components and their factor


def nodal_force__loops(P, grad_phi, area, h):
    f = ti.Vector([0.0, 0.0, 0.0])  # the force before the loop
    for i in range(3):  # the components of the force
        for j in range(3):  # the sum over a row of P
            f[i] -= h * area * P[i, j] * grad_phi[j]  # each component, term by term
    return f  # the force


def nodal_force__columns(P, grad_phi, area, h):
    g = grad_phi  # the gradient
    f = g[0] * P[:, 0] + g[1] * P[:, 1] + g[2] * P[:, 2]  # the columns of P times the gradient's components
    return -h * area * f  # the force


def nodal_force__sum(P, grad_phi, area, h):
    """Area and thickness are added, where they should be multiplied.

    A volume is area times thickness.
    """
    return -(h + area) * (P @ grad_phi)


def nodal_force__symmetric(P, grad_phi, area, h):
    """Only the symmetric part of P is used.

    P need not be symmetric: use it as it comes.
    """
    return -h * area * ((P + P.transpose()) / 2 @ grad_phi)


def nodal_force__diagonal(P, grad_phi, area, h):
    """Only the diagonal of P is used.

    The force is a matrix times a vector: each component sums over a whole row of P.
    """
    return -h * area * ti.Vector([P[0, 0], P[1, 1], P[2, 2]]) * grad_phi


def nodal_force__no_depth(P, grad_phi, area, h):
    """The third component is zero.

    The cloth lives in space: use all three rows of P.
    """
    f = -h * area * (P @ grad_phi)
    return ti.Vector([f[0], f[1], 0.0])


# --- d2psi_dFij ----------------------------------------------------------------------------------------------


def d2psi_dFij(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    c = d2psi_ds2 @ ds  # the change of psi_s by the chain rule
    a = dU @ diag(dpsi_ds) @ V.transpose()  # the first term
    b = U @ diag(c) @ V.transpose()  # the middle term
    d = U @ diag(dpsi_ds) @ dV.transpose()  # the last term
    return a + b + d  # the sum of the three terms


def d2psi_dFij__chain_rule(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    c = ti.Vector([0.0, 0.0, 0.0])  # the change of psi_s before the loop
    for i in range(3):  # the components of the change of psi_s
        for j in range(3):  # the sum of the chain rule
            c[i] += d2psi_ds2[i, j] * ds[j]  # the chain rule in the middle term
    A = (dU @ diag(dpsi_ds) + U @ diag(c)) @ V.transpose()  # the first and the middle term
    return A + U @ diag(dpsi_ds) @ dV.transpose()  # the last term added


def d2psi_dFij__full(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """The whole Hessian of psi stands in the middle term, where a diagonal matrix belongs.

    How psi_s changes is a vector: the Hessian times ds. Its diagonal matrix stands in the middle.
    """
    return (
        dU @ diag(dpsi_ds) @ V.transpose()
        + U @ d2psi_ds2 @ V.transpose()
        + U @ diag(dpsi_ds) @ dV.transpose()
    )


def d2psi_dFij__diagonals(U, V, dpsi_ds, d2psi_ds2, dU, ds, dV):
    """The Hessian of psi is multiplied with the diagonal matrix of ds, which leaves a full matrix in the middle.

    How psi_s changes is a vector: the Hessian times ds. Its diagonal matrix stands in the middle.
    """
    b = U @ (d2psi_ds2 @ diag(ds)) @ V.transpose()
    return dU @ diag(dpsi_ds) @ V.transpose() + b + U @ diag(dpsi_ds) @ dV.transpose()


# --- eigensystem ---------------------------------------------------------------------------------------------


def eigensystem(s, dpsi_ds, d2psi_ds2):
    p = dpsi_ds[0]  # the stress psi_0
    q = dpsi_ds[1]  # the stress psi_1
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]  # the limit of flip
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])  # the quotient of flip
    twist = (p + q) / max(s[0] + s[1], 1e-6)  # the quotient of twist
    a = p / max(s[0], 1e-6)  # out_0
    b = q / max(s[1], 1e-6)  # out_1
    return ti.Vector([flip, twist, a, b])  # the four values


def eigensystem__mean(s, dpsi_ds, d2psi_ds2):
    p = dpsi_ds[0]  # the stress psi_0
    q = dpsi_ds[1]  # the stress psi_1
    gap = s[0] - s[1]  # the gap of the stretches
    flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]  # the limit of flip
    if abs(gap) > 1e-3:
        flip = (p - q) / gap  # the quotient of flip
    twist = (p + q) / max(s[0] + s[1], 1e-6)  # the quotient of twist
    a = p / max(s[0], 1e-6)  # the quotient of out_0
    b = q / max(s[1], 1e-6)  # the quotient of out_1
    return ti.Vector([flip, twist, a, b])  # the four values


def eigensystem__floor_below_one(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i - 1 (kept from zero): that is the mode of the 3x3 matrix, singular at rest.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / max(s[0] - 1, 1e-6), q / max(s[1] - 1, 1e-6)])


def eigensystem__floor_below_one_abs(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by |s_i - 1| (kept from zero): that is the mode of the 3x3 matrix, singular at rest.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / max(abs(s[0] - 1), 1e-6), q / max(abs(s[1] - 1), 1e-6)])


def eigensystem__guarded_minus(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i - 1, and set to zero at rest: that is the mode of the 3x3 matrix.

    The normal turns along when the cloth tilts. Both changes at once leave a milder denominator.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist, a, b = (p + q) / max(s[0] + s[1], 1e-6), 0.0, 0.0
    if abs(s[0] - 1) > 1e-6:
        a = p / (s[0] - 1)
    if abs(s[1] - 1) > 1e-6:
        b = q / (s[1] - 1)
    return ti.Vector([flip, twist, a, b])


def eigensystem__plus_one(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i + 1: that is the other mode of the 3x3 matrix, which knows no normal that turns.

    The normal turns along when the cloth tilts. Add both modes up as the handout does.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / (s[0] + 1), q / (s[1] + 1)])


def eigensystem__plus_third(s, dpsi_ds, d2psi_ds2):
    """out_i is divided by s_i + s_2, as if the third stretch were one of the energy's.

    The normal turns along when the cloth tilts: only the stretch s_i is left below.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    twist = (p + q) / max(s[0] + s[1], 1e-6)
    return ti.Vector([flip, twist, p / (s[0] + s[2]), q / (s[1] + s[2])])


def eigensystem__pushed(s, dpsi_ds, d2psi_ds2):
    """A small number is added to the denominators: then they are wrong everywhere, by a little.

    Divide by the larger of the two, the denominator and 1e-6: where nothing collapses, nothing changes.
    """
    p, q = dpsi_ds[0], dpsi_ds[1]
    flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
    if abs(s[0] - s[1]) > 1e-3:
        flip = (p - q) / (s[0] - s[1])
    return ti.Vector([flip, (p + q) / (s[0] + s[1] + 1e-6), p / (s[0] + 1e-6), q / (s[1] + 1e-6)])


# --- sphere_contact ------------------------------------------------------------------------------------------


def sphere_contact(x, c, r):
    d = x - c  # the vector from the centre to the vertex
    n = ti.Vector([0.0, 1.0, 0.0])  # the normal at the centre
    if d.norm() > 0:
        n = d.normalized()  # the normal
    return ti.cast(d.norm() < r, ti.i32), n  # the hit


def sphere_contact__components(x, c, r):
    a = x[0] - c[0]  # component 0 of the vector from the centre, in x
    b = x[1] - c[1]  # component 1 of the vector from the centre, in y
    d = x[2] - c[2]  # component 2 of the vector from the centre, in z
    size = ti.sqrt(a * a + b * b + d * d)  # the distance from the centre
    n = ti.Vector([0.0, 1.0, 0.0])  # the normal at the centre
    if size > 0:
        n = ti.Vector([a, b, d]) / size  # the normal
    hit = 0  # the hit outside
    if size < r:
        hit = 1  # the hit inside
    return hit, n  # the two results


def sphere_contact__squares(x, c, r):
    d = x - c  # the vector from the centre to the vertex
    a = d.dot(d)  # the squared distance
    n = ti.Vector([0.0, 1.0, 0.0])  # the normal at the centre
    if a > 0:
        n = d / ti.sqrt(a)  # the normal
    hit = 0  # the hit outside
    if a < r * r:
        hit = 1  # the hit inside
    return hit, n  # the two results


def sphere_contact__quotient(x, c, r):
    d = x - c  # the vector from the centre to the vertex
    size = d.norm()  # the distance from the centre
    n = ti.Vector([0.0, 1.0, 0.0])  # the normal at the centre
    if size > 0:
        n = d / size  # the normal
    return ti.cast(size < r, ti.i32), n  # the hit


def sphere_contact__always(x, c, r):
    """Every vertex counts as a hit.

    Compare its distance from the centre with the radius.
    """
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return 1, n


def sphere_contact__wide_guard(x, c, r):
    """Near the centre your normal is the one agreed on for the very centre.

    Only at distance zero there is no way out: look at the number you compare the distance with.
    """
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0.01:
        n = d.normalized()
    return ti.cast(d.norm() < r, ti.i32), n


def sphere_contact__pushed(x, c, r):
    """A small number is added to the distance you divide by: then the normal is nowhere of length one.

    Divide by the distance itself, and treat the centre separately.
    """
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d / (d.norm() + 1e-6)
    return ti.cast(d.norm() < r, ti.i32), n


# --- filter_velocity -----------------------------------------------------------------------------------------


def filter_velocity(v, n):
    d = n.dot(v)  # the velocity along n, the dot product of v and n
    w = v  # the velocity that is kept
    if d < 0:
        p = d * n  # the part of v along n
        w = v - p  # the filtered velocity, which slides along the surface
    return w  # the result


def filter_velocity__min(v, n):
    d = min(n.dot(v), 0.0)  # the velocity into the obstacle, zero or less
    return v - d * n  # the filtered velocity


def filter_velocity__components(v, n):
    d = n[0] * v[0] + n[1] * v[1] + n[2] * v[2]  # the velocity along n, the dot product of v and n
    w = v  # the velocity that is kept
    if d < 0:
        w = ti.Vector([v[0] - d * n[0], v[1] - d * n[1], v[2] - d * n[2]])  # the filtered velocity
    return w  # the result


def filter_velocity__product(v, n):
    w = v  # the velocity that is kept
    if v.dot(n) < 0:
        w = v - v.dot(n) * n  # the filtered velocity
    return w  # the result


def filter_velocity__matrix(v, n):
    w = v  # the velocity that is kept
    if v.dot(n) < 0:
        w = (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ v  # the projected velocity
    return w  # the result


def filter_velocity__unit(v, n):
    """The normal itself is taken away, whatever the velocity along it is.

    Take away as much of n as the velocity goes along it: d n.
    """
    w = v
    if n.dot(v) < 0:
        w = v - n
    return w


def filter_velocity__unit_plus(v, n):
    """The normal itself is added, whatever the velocity along it is.

    Take away as much of n as the velocity goes along it: d n.
    """
    w = v
    if n.dot(v) < 0:
        w = v + n
    return w


def filter_velocity__crossed(v, n):
    """The velocity is n x v: turned by a right angle within the surface.

    Take the part along n away from v; what slides along the surface stays as it is.
    """
    w = v
    if n.dot(v) < 0:
        w = n.cross(v)
    return w


def filter_velocity__entrywise(v, n):
    """n and v are multiplied entry by entry, where their dot product is asked.

    How fast the vertex moves along n is one number.
    """
    w = v
    if n.dot(v) < 0:
        w = v - n * v * n
    return w


def filter_velocity__vertical(v, n):
    """The vertical component is set to zero, whatever way n points.

    The obstacle may lie on any side: use n.
    """
    w = v
    if v[1] < 0:
        w = ti.Vector([v[0], 0.0, v[2]])
    return w


def filter_velocity__vertical_along_n(v, n):
    """The vertical component is set to zero, whatever way n points.

    The obstacle may lie on any side: use n.
    """
    w = v
    if n.dot(v) < 0:
        w = ti.Vector([v[0], 0.0, v[2]])
    return w
