"""A triangle.  (S3)"""

import taichi as ti


@ti.func
def edges(x0, x1, x2):
    """x0, x1, x2: vec3 [m]; returns vec6 [m] and the area [m^2]."""
    # begin solution: two edges from vertex 0, and half of their cross product's length
    e = x1 - x0
    f = x2 - x0
    return ti.Vector([e[0], e[1], e[2], f[0], f[1], f[2]]), 0.5 * e.cross(f).norm()
    # end solution
