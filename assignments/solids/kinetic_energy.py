# solids 1.0: fill in the functions of this file; README.md explains each.
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
    # Your code here: the integral of phi_i phi_j over a tetrahedron, for i = j and for i != j
    raise NotImplementedError


@ti.func
def kinetic_energy(v0, v1, v2, v3, volume, rho):
    """T = 1/2 qdot^T M_e qdot.

    v0..v3  : velocities of the vertices, vec3 [m/s]
    volume  : undeformed volume of the tetrahedron [m^3]
    rho     : density [kg/m^3]
    returns : T [J]
    """
    # Your code here: multiply the double sum over i and j out, with the two fractions of S4 put in by hand
    raise NotImplementedError
