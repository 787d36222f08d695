"""Ways to write `sphere_contact`, `filter_velocity`: see the folder's `__init__`."""

import taichi as ti

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
