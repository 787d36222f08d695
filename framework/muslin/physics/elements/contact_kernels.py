"""Kernels that call the student's collision functions (see `contact`)."""

from typing import Any

from muslin.base.arrays import integers, scalars, vec3s
from muslin.base.engine import ti


def detection(f: Any, serial: bool) -> Any:
    """Kernel of `sphere_contact` on the first `count[0]` vertices."""

    @ti.kernel
    def kernel(count: integers, x: vec3s, c: vec3s, r: scalars, hit: integers, normal: vec3s):
        ti.loop_config(serialize=serial)
        for k in range(count[0]):
            touched, n = f(x[k], c[k], r[0])
            hit[k], normal[k] = touched, n

    return kernel


def response(f: Any, serial: bool) -> Any:
    """Kernel of `filter_velocity` on the first `count[0]` vertices."""

    @ti.kernel
    def kernel(count: integers, v: vec3s, normal: vec3s, out: vec3s):
        ti.loop_config(serialize=serial)
        for k in range(count[0]):
            out[k] = f(v[k], normal[k])

    return kernel
