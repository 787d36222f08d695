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
    # begin solution: compare the distance from the centre with r; guard the division at distance zero
    d = x - c
    n = ti.Vector([0.0, 1.0, 0.0])
    if d.norm() > 0:
        n = d.normalized()
    return ti.cast(d.norm() < r, ti.i32), n
    # end solution


@ti.func
def filter_velocity(v, n):
    """Take away the part of a velocity that goes into the obstacle, and nothing else.

    v       : velocity of a vertex in contact, relative to the obstacle, vec3 [m/s]
    n       : unit contact normal, outward, vec3 [1]
    returns : filtered velocity, vec3 [m/s]
    """
    # begin solution: d = n^T v; only if d < 0, project
    d = n.dot(v)
    v_new = v
    if d < 0:
        v_new = v - d * n
    return v_new
    # end solution
