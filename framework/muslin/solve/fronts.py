"""Cholesky factorisation by fronts of 3x3 blocks: the kernel of `muslin.solve.multifrontal`.

A front is a dense part of the factor: some vertices, its pivots, and below them its border, the later vertices
they touch. Its panel holds the pivots' columns row by row of blocks, each block column by column: a product of
two rows then reads both from end to end. A block's columns are stored as four numbers, the last of them zero, which
the processor takes at once; places in panels count columns. On the diagonal stand the inverses of the factor's own
blocks.
"""

from typing import Any

from muslin.base.arrays import integers, scalars, vec4s
from muslin.base.engine import ti

#: Columns of the table of fronts. A part of another array ends where the next front's begins.
PIVOTS, BORDER, PANEL, FIRST, ROWS, BLOCKS, SEGMENTS, WIDTH = range(8)
#: Columns of the table of segments, the parts of a border that are pivots of one and the same front.
OWNER, BEGIN, END, PLACES, SEGMENT = range(5)


def factorisation(serial: bool) -> Any:
    """The kernel: tasks on threads of their own, unless `serial`, then what joins them, on one thread.

    Its arguments are those of `muslin.solve.multifrontal.Plan`, and the matrix, the factor, the right-hand side, which
    becomes the solution, and a flag that is set where the matrix is not positive definite.
    """

    @ti.kernel
    def factorise_and_solve(
        fronts: integers, segments: integers, order: integers, tasks: integers, joints: integers,
        rows: integers, places: integers, target: integers,
        data: vec4s, L: vec4s, y: scalars, bad: integers,
    ):  # fmt: skip
        ti.loop_config(serialize=serial, block_dim=1)
        for t in range(joints.shape[0] - 1):
            for k in range(tasks[t], tasks[t + 1]):
                empty(fronts, order[k], L)
            for k in range(joints[t], joints[t + 1]):
                empty(fronts, k, L)
                for i in range(3 * fronts[k * WIDTH + PIVOTS]):
                    y[3 * fronts[k * WIDTH + FIRST] + i] = 0.0
            for k in range(tasks[t], tasks[t + 1]):
                down(fronts, segments, order[k], rows, places, target, data, L, y, bad)
        ti.loop_config(serialize=True)
        for _ in range(1):
            last = joints.shape[0] - 1
            begin, end = tasks[last], tasks[last + 1]
            for k in range(begin, end):
                empty(fronts, order[k], L)
            for k in range(joints[0], joints[last]):
                join(fronts, segments, k, rows, places, L, y)
            for k in range(begin, end):
                down(fronts, segments, order[k], rows, places, target, data, L, y, bad)
            for k in range(end - begin):
                up(fronts, order[end - 1 - k], rows, L, y)
        ti.loop_config(serialize=serial, block_dim=1)
        for t in range(joints.shape[0] - 1):
            for k in range(joints[t], joints[t + 1]):
                f = k * WIDTH
                for i in range(fronts[f + PIVOTS]):
                    put3(y, 3 * (fronts[f + FIRST] + i), get3(y, 3 * rows[fronts[f + ROWS] + i]))
            for k in range(tasks[t + 1] - tasks[t]):
                up(fronts, order[tasks[t + 1] - 1 - k], rows, L, y)

    return factorise_and_solve


def solution(serial: bool) -> Any:
    """The kernel that solves with the factor that there is, for a right-hand side in y."""

    @ti.kernel
    def solve(
        fronts: integers, order: integers, tasks: integers, joints: integers, rows: integers, L: vec4s, y: scalars
    ):  # fmt: skip
        ti.loop_config(serialize=serial, block_dim=1)
        for t in range(joints.shape[0] - 1):
            for k in range(joints[t], joints[t + 1]):
                for i in range(3 * fronts[k * WIDTH + PIVOTS]):
                    y[3 * fronts[k * WIDTH + FIRST] + i] = 0.0
            for k in range(tasks[t], tasks[t + 1]):
                forward(fronts, order[k], rows, L, y)
        ti.loop_config(serialize=True)
        for _ in range(1):
            last = joints.shape[0] - 1
            begin, end = tasks[last], tasks[last + 1]
            for k in range(joints[0], joints[last]):
                f = k * WIDTH
                for i in range(fronts[f + PIVOTS]):
                    at = 3 * rows[fronts[f + ROWS] + i]
                    put3(y, at, get3(y, at) + get3(y, 3 * (fronts[f + FIRST] + i)))
            for k in range(begin, end):
                forward(fronts, order[k], rows, L, y)
            for k in range(end - begin):
                up(fronts, order[end - 1 - k], rows, L, y)
        ti.loop_config(serialize=serial, block_dim=1)
        for t in range(joints.shape[0] - 1):
            for k in range(joints[t], joints[t + 1]):
                f = k * WIDTH
                for i in range(fronts[f + PIVOTS]):
                    put3(y, 3 * (fronts[f + FIRST] + i), get3(y, 3 * rows[fronts[f + ROWS] + i]))
            for k in range(tasks[t + 1] - tasks[t]):
                up(fronts, order[tasks[t + 1] - 1 - k], rows, L, y)

    return solve


@ti.func
def forward(fronts: ti.template(), k, rows: ti.template(), L: ti.template(), y: ti.template()):
    """Take what a front's pivots account for from the right-hand side."""
    f = k * WIDTH
    pivots, border, panel = fronts[f + PIVOTS], fronts[f + BORDER], fronts[f + PANEL]
    first, stride = 3 * fronts[f + FIRST], 3 * pivots
    for j in range(pivots):
        row = panel + j * stride
        r = get3(y, first + 3 * j) - times(L, row, y, first, 3 * j)
        put3(y, first + 3 * j, top(get(L, row + 3 * j)) @ r)
    for i in range(border):
        at = 3 * rows[fronts[f + ROWS] + i]
        put3(y, at, get3(y, at) - times(L, panel + (pivots + i) * stride, y, first, 3 * pivots))


@ti.func
def empty(fronts: ti.template(), k, L: ti.template()):
    """Set a panel to zero, before anything is added to it."""
    f = k * WIDTH
    size = 3 * fronts[f + PIVOTS] * (fronts[f + PIVOTS] + fronts[f + BORDER])
    for i in range(fronts[f + PANEL], fronts[f + PANEL] + size):
        L[index(i)] = ti.Vector.zero(ti.f64, 4)


@ti.func
def down(
    fronts: ti.template(), segments: ti.template(), k, rows: ti.template(), places: ti.template(),
    target: ti.template(), data: ti.template(), L: ti.template(), y: ti.template(), bad: ti.template(),
):  # fmt: skip
    """Factorise a front, and take its share from later fronts and from the right-hand side."""
    f = k * WIDTH
    pivots, border, panel = fronts[f + PIVOTS], fronts[f + BORDER], fronts[f + PANEL]
    first, begin, stride = 3 * fronts[f + FIRST], fronts[f + ROWS], 3 * pivots
    for i in range(fronts[f + BLOCKS], fronts[f + WIDTH + BLOCKS]):
        at, block = index(target[i]), index(3 * i)
        for b in ti.static(range(3)):
            L[at + b] = L[at + b] + data[block + b]
    for j in range(pivots):
        row = panel + j * stride
        W = inverse_root(get(L, row + 3 * j) - product(L, row, row, j), bad)
        put(L, row + 3 * j, W)
        for i in range(j + 1, pivots + border):
            at = panel + i * stride
            A = get(L, at + 3 * j) - product(L, at, row, j)
            put(L, at + 3 * j, A @ top(W).transpose())
        r = get3(y, first + 3 * j) - times(L, row, y, first, 3 * j)
        put3(y, first + 3 * j, top(W) @ r)
    for i in range(border):
        at = 3 * rows[begin + i]
        put3(y, at, get3(y, at) - times(L, panel + (pivots + i) * stride, y, first, 3 * pivots))
    for s in range(fronts[f + SEGMENTS], fronts[f + WIDTH + SEGMENTS]):
        g = segments[s * SEGMENT + OWNER] * WIDTH
        start, place = segments[s * SEGMENT + BEGIN], segments[s * SEGMENT + PLACES]
        for j in range(start, segments[s * SEGMENT + END]):
            column, row = fronts[g + PANEL] + 3 * places[place + j - start], panel + (pivots + j) * stride
            for i in range(j, border):
                at = column + 3 * places[place + i - start] * fronts[g + PIVOTS]
                put(L, at, get(L, at) - product(L, panel + (pivots + i) * stride, row, pivots))


@ti.func
def join(
    fronts: ti.template(), segments: ti.template(), k, rows: ti.template(), places: ti.template(),
    L: ti.template(), y: ti.template(),
):  # fmt: skip
    """Take what a task has gathered in a joint from the fronts that join the tasks."""
    f = k * WIDTH
    size, panel = fronts[f + PIVOTS], fronts[f + PANEL]
    for i in range(size):
        at = 3 * rows[fronts[f + ROWS] + i]
        put3(y, at, get3(y, at) + get3(y, 3 * (fronts[f + FIRST] + i)))
    for s in range(fronts[f + SEGMENTS], fronts[f + WIDTH + SEGMENTS]):
        g = segments[s * SEGMENT + OWNER] * WIDTH
        start, place = segments[s * SEGMENT + BEGIN], segments[s * SEGMENT + PLACES]
        for j in range(start, segments[s * SEGMENT + END]):
            column = fronts[g + PANEL] + 3 * places[place + j - start]
            for i in range(j, size):
                at = column + 3 * places[place + i - start] * fronts[g + PIVOTS]
                put(L, at, get(L, at) + get(L, panel + 3 * (i * size + j)))


@ti.func
def up(fronts: ti.template(), k, rows: ti.template(), L: ti.template(), y: ti.template()):
    """The solution at the pivots of a front, from that at its border."""
    f = k * WIDTH
    pivots, border, panel = fronts[f + PIVOTS], fronts[f + BORDER], fronts[f + PANEL]
    first, begin, stride = 3 * fronts[f + FIRST], fronts[f + ROWS], 3 * pivots
    for i in range(border):
        subtract(L, panel + (pivots + i) * stride, get3(y, 3 * rows[begin + i]), y, first, 3 * pivots)
    for i in range(pivots):
        j = pivots - 1 - i
        row, at = panel + j * stride, first + 3 * j
        put3(y, at, top(get(L, row + 3 * j)).transpose() @ get3(y, at))
        subtract(L, row, get3(y, at), y, first, 3 * j)


@ti.func
def product(L: ti.template(), i, j, blocks):
    """L_i L_j^T of two rows that begin at i and j, over their first `blocks` blocks."""
    c0, c1, c2 = ti.Vector.zero(ti.f64, 4), ti.Vector.zero(ti.f64, 4), ti.Vector.zero(ti.f64, 4)
    for p in range(blocks):
        at, other = index(i + 3 * p), index(j + 3 * p)
        for c in ti.static(range(3)):
            v, w = L[at + c], L[other + c]
            c0 += v * w[0]
            c1 += v * w[1]
            c2 += v * w[2]
    return ti.Matrix.cols([c0, c1, c2])


@ti.func
def times(L: ti.template(), row, y: ti.template(), first, width):
    """A row of blocks times the numbers of y from `first` on."""
    total = ti.Vector.zero(ti.f64, 4)
    for p in range(width):
        total += L[index(row + p)] * y[first + p]
    return total[:3]


@ti.func
def subtract(L: ti.template(), row, x, y: ti.template(), first, width):
    """Take a row of blocks, transposed, times x from the numbers of y from `first` on."""
    for p in range(width):
        v = L[index(row + p)]
        y[first + p] = y[first + p] - (v[0] * x[0] + v[1] * x[1] + v[2] * x[2])


@ti.func
def inverse_root(A, bad: ti.template()):
    """W = L^-1 of A = L L^T, 3x3 lower triangular."""
    L, W = ti.Matrix.zero(ti.f64, 3, 3), ti.Matrix.zero(ti.f64, 4, 3)
    for b in ti.static(range(3)):
        for a in ti.static(range(b, 3)):
            rest = A[a, b]
            for c in ti.static(range(b)):
                rest -= L[a, c] * L[b, c]
            if ti.static(a == b):
                if not rest > 0.0:
                    bad[0] = 1
                    rest = 1.0
                L[b, b] = ti.sqrt(rest)
                W[b, b] = 1 / L[b, b]
            else:
                L[a, b] = rest * W[b, b]
    W[1, 0] = -L[1, 0] * W[0, 0] * W[1, 1]
    W[2, 1] = -L[2, 1] * W[1, 1] * W[2, 2]
    W[2, 0] = -(L[2, 0] * W[0, 0] + L[2, 1] * W[1, 0]) * W[2, 2]
    return W


@ti.func
def index(at):
    """An index, known not to be negative: then the compiler sees that the four numbers there lie side by side.

    In a loop that counts it up it cannot: for all it knows, 32 bits overflow between one number and the next.
    """
    return ti.max(at, 0)


@ti.func
def get(L: ti.template(), at):
    """The block that begins at a column."""
    k = index(at)
    return ti.Matrix.cols([L[k], L[k + 1], L[k + 2]])


@ti.func
def put(L: ti.template(), at, B):
    """Store a block."""
    k = index(at)
    for b in ti.static(range(3)):
        L[k + b] = ti.Vector([B[a, b] for a in ti.static(range(4))])


@ti.func
def top(B):
    """A block without its last row."""
    return ti.Matrix([[B[a, b] for b in ti.static(range(3))] for a in ti.static(range(3))])


@ti.func
def get3(y: ti.template(), at):
    """The three numbers that begin at a position."""
    return ti.Vector([y[at], y[at + 1], y[at + 2]])


@ti.func
def put3(y: ti.template(), at, v):
    """Store three numbers."""
    for a in ti.static(range(3)):
        y[at + a] = v[a]
