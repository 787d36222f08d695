"""Ways to write `mass_block`, `kinetic_energy`: see the folder's `__init__`."""

import taichi as ti

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


# fmt: off
def kinetic_energy__six_terms(v0, v1, v2, area, rho, h):
    m = rho * h * area / 6  # the mass on the diagonal
    k = rho * h * area / 12  # the mass off the diagonal
    a = 0.5 * m * v0.dot(v0) + 0.5 * m * v1.dot(v1) + 0.5 * m * v2.dot(v2)  # the squares v_i . v_i, of the diagonal
    b = k * v0.dot(v1) + k * v1.dot(v2) + k * v0.dot(v2)  # the mixed terms v_i . v_j, i < j
    return a + b  # the sum of squares and mixed terms
# fmt: on


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
