"""Annotations of the numpy arrays that element kernels take: one row per triangle, vertex or block."""

from muslin.base import runtime
from muslin.base.engine import ti

REAL = runtime.real()
#: What keeps a division by zero finite.
TINY = 1e-30 if REAL is ti.f32 else 1e-300

scalars = ti.types.ndarray(dtype=REAL, ndim=1)
integers = ti.types.ndarray(dtype=ti.i32, ndim=1)
index2 = ti.types.ndarray(dtype=ti.types.vector(2, ti.i32), ndim=1)
index3 = ti.types.ndarray(dtype=ti.types.vector(3, ti.i32), ndim=1)
index4 = ti.types.ndarray(dtype=ti.types.vector(4, ti.i32), ndim=1)
vec3s = ti.types.ndarray(dtype=ti.types.vector(3, REAL), ndim=1)
vec4s = ti.types.ndarray(dtype=ti.types.vector(4, REAL), ndim=1)
vec5s = ti.types.ndarray(dtype=ti.types.vector(5, REAL), ndim=1)
mat3s = ti.types.ndarray(dtype=ti.types.matrix(3, 3, REAL), ndim=1)
mat4x3s = ti.types.ndarray(dtype=ti.types.matrix(4, 3, REAL), ndim=1)
mat9s = ti.types.ndarray(dtype=ti.types.matrix(9, 9, REAL), ndim=1)
rows = ti.types.ndarray(dtype=REAL, ndim=2)
