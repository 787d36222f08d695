# cloth 1.0: fill in the functions of this file; README.md explains each.
"""Collision with a sphere: detection, then a velocity filter.  (S9; lecture "Collisions in Simulation")"""

import taichi as ti


@ti.func
def sphere_contact(x, c, r):
    """Did the vertex hit the sphere, and which way is out?  At the very centre, out is up: (0, 1, 0).

    x       : position of the vertex, vec3 [m]
    c       : centre of the sphere, vec3 [m]
    r       : radius of the sphere [m]
    returns : hit (1 inside the sphere, else 0), n (unit contact normal, outward, vec3 [1])
    """
    # Your code here: compare the distance from the centre with r; guard the division at distance zero
    raise NotImplementedError


@ti.func
def filter_velocity(v, n):
    """Take away the part of a velocity that goes into the obstacle, and nothing else.

    v       : velocity of a vertex in contact, relative to the obstacle, vec3 [m/s]
    n       : unit contact normal, outward, vec3 [1]
    returns : filtered velocity, vec3 [m/s]
    """
    # Your code here: d = n^T v; only if d < 0, project
    raise NotImplementedError
