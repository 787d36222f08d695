"""Kernels that gather: rows of cells into vertices and blocks, in a fixed order (see `pattern`)."""

import functools

from muslin.base.arrays import index2, integers, mat3s, rows, scalars, vec3s
from muslin.base.engine import ti
from muslin.physics.elements import modes


@functools.cache
def gather_vector(serial: bool):
    """Kernel that sums rows into vertices."""

    @ti.kernel
    def kernel(rows: vec3s, ptr: integers, index: integers, out: vec3s):
        ti.loop_config(serialize=serial)
        for i in range(out.shape[0]):
            total = ti.Vector([0.0, 0.0, 0.0])
            for k in range(ptr[i], ptr[i + 1]):
                total += rows[index[k]]
            out[i] = total

    return kernel


@ti.func
def _write(data: ti.template(), start, stride, B):
    for a, b in ti.static(ti.ndrange(3, 3)):
        data[start + a * stride + b] = B[a, b]


@functools.cache
def assemble_modes(serial: bool):
    """Kernel that sums Hessians kept as modes, and mass, into blocks."""

    @ti.kernel
    def kernel(
        row: rows,
        begin_end: index2,
        index: integers,
        start: integers,
        stride: integers,
        mass: scalars,
        scale: scalars,
        data: scalars,
    ):
        ti.loop_config(serialize=serial)
        for k in range(start.shape[0]):
            total = ti.Matrix.zero(float, 3, 3)
            for c in range(begin_end[k][0], begin_end[k][1]):
                e, pair = index[c] // 9, index[c] % 9
                total += modes.load(row, e, pair // 3, pair % 3)
            _write(data, start[k], stride[k], scale[0] * total + mass[k] * ti.Matrix.identity(float, 3))

    return kernel


@functools.cache
def assemble_blocks(serial: bool):
    """Kernel that sums Hessians kept as blocks, and mass, into blocks."""

    @ti.kernel
    def kernel(
        blocks: mat3s,
        begin_end: index2,
        index: integers,
        start: integers,
        stride: integers,
        mass: scalars,
        scale: scalars,
        data: scalars,
    ):
        ti.loop_config(serialize=serial)
        for k in range(start.shape[0]):
            total = ti.Matrix.zero(float, 3, 3)
            for c in range(begin_end[k][0], begin_end[k][1]):
                total += blocks[index[c]]
            _write(data, start[k], stride[k], scale[0] * total + mass[k] * ti.Matrix.identity(float, 3))

    return kernel


@functools.cache
def add_blocks(serial: bool):
    """Kernel that adds more Hessians kept as blocks to what has been assembled."""

    @ti.kernel
    def kernel(
        blocks: mat3s,
        begin_end: index2,
        index: integers,
        start: integers,
        stride: integers,
        scale: scalars,
        data: scalars,
    ):
        ti.loop_config(serialize=serial)
        for k in range(start.shape[0]):
            total = ti.Matrix.zero(float, 3, 3)
            for c in range(begin_end[k][0], begin_end[k][1]):
                total += blocks[index[c]]
            for a, b in ti.static(ti.ndrange(3, 3)):
                data[start[k] + a * stride[k] + b] += scale[0] * total[a, b]

    return kernel


@functools.cache
def kinetic_energy(serial: bool):
    """Kernel of 1/2 v_i^T (M v)_i."""

    @ti.kernel
    def kernel(block_ptr: integers, neighbour: integers, mass: scalars, v: vec3s, out: scalars):
        ti.loop_config(serialize=serial)
        for i in range(out.shape[0]):
            momentum = ti.Vector([0.0, 0.0, 0.0])
            for k in range(block_ptr[i], block_ptr[i + 1]):
                momentum += mass[k] * v[neighbour[k]]
            out[i] = v[i].dot(momentum) / 2

    return kernel


@functools.cache
def impulse(serial: bool):
    """Kernel of M v + dt (force - gradient)."""

    @ti.kernel
    def kernel(
        rows: vec3s,
        ptr: integers,
        index: integers,
        block_ptr: integers,
        neighbour: integers,
        mass: scalars,
        v: vec3s,
        force: vec3s,
        dt: scalars,
        out: vec3s,
    ):
        ti.loop_config(serialize=serial)
        for i in range(out.shape[0]):
            momentum, pull = ti.Vector([0.0, 0.0, 0.0]), force[i]
            for k in range(block_ptr[i], block_ptr[i + 1]):
                momentum += mass[k] * v[neighbour[k]]
            for k in range(ptr[i], ptr[i + 1]):
                pull -= rows[index[k]]
            out[i] = momentum + dt[0] * pull

    return kernel
