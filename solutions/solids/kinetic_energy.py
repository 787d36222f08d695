"""Kinetic energy of a tetrahedron and its mass matrix, integrated exactly.  (S4; lecture "Kinetic Energy")"""

import taichi as ti


@ti.func
def mass_block(i, j, volume, rho):
    """Factor of the 3x3 identity in block (i, j) of M_e = integral of rho N(X)^T N(X) dV.

    i, j    : local vertices, 0, 1, 2 or 3
    volume  : undeformed volume of the tetrahedron [m^3]
    rho     : density [kg/m^3]
    returns : mass [kg]
    """
    # begin solution: the integral of phi_i phi_j over a tetrahedron, for i = j and for i != j
    m = rho * volume / 20
    if i == j:
        m = rho * volume / 10
    return m
    # end solution


@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    """T = 1/2 qdot^T M_e qdot.

    v0..v3  : velocities of the vertices, vec3 [m/s]
    volume  : undeformed volume of the tetrahedron [m^3]
    rho     : density [kg/m^3]
    returns : T [J]
    """
    # begin solution: multiply the double sum over i and j out, with the two fractions of S4 put in by hand
    squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2) + v3.dot(v3)
    products = v0.dot(v1 + v2 + v3) + v1.dot(v2 + v3) + v2.dot(v3)
    return rho * volume / 20 * (squares + products)
    # end solution
