# cloth 1.0: fill in the functions of this file; README.md explains each.
"""Kinetic energy of a triangle and its mass matrix, integrated exactly.  (S4; lecture "Kinetic Energy")"""

import taichi as ti


@ti.func
def mass_block(i, j, area, rho, h):
    """Factor of the 3x3 identity in block (i, j) of M_e = h * integral of rho N(X)^T N(X) dA.

    i, j    : local vertices, 0, 1 or 2
    area    : undeformed area of the triangle [m^2]
    rho     : density [kg/m^3]
    h       : thickness [m]
    returns : mass [kg]
    """
    # Your code here: the integral of phi_i phi_j over a triangle, for i = j and for i != j
    raise NotImplementedError


@ti.func
def kinetic_energy(v0, v1, v2, area, rho, h):
    """T = 1/2 qdot^T M_e qdot.

    v0, v1, v2 : velocities of the vertices, vec3 [m/s]
    area       : undeformed area of the triangle [m^2]
    rho        : density [kg/m^3]
    h          : thickness [m]
    returns    : T [J]
    """
    # Your code here: multiply the double sum over i and j out, with the two fractions of S4 put in by hand
    raise NotImplementedError
