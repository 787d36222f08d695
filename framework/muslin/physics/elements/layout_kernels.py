"""Kernels that find where things go, on one thread: whole numbers only (see `layout`).

What is symmetric needs no sorting: who goes through the columns in their order, and puts each into its rows, has rows
that ascend. Loops are `while`s: the engine makes them three times as fast as inner `for`s.
"""

from muslin.base.arrays import integers
from muslin.base.engine import ti


@ti.kernel
def grouped(labels: integers, place: integers, order: integers, ptr: integers):
    """Numbers of labels, by their labels, and where those of each begin."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        count, k = place.shape[0], 0
        while k < labels.shape[0]:
            ptr[labels[k] + 1] = ptr[labels[k] + 1] + 1
            k += 1
        k = 0
        while k < count:
            place[k] = ptr[k]
            ptr[k + 1] = ptr[k + 1] + ptr[k]
            k += 1
        k = 0
        while k < labels.shape[0]:
            at = place[labels[k]]
            order[at] = k
            place[labels[k]] = at + 1
            k += 1


def _pairs(k: int):
    """Kernel of each pair of a cell's k corners: by vertex, and there by the other vertex; and where those are new."""

    @ti.kernel
    def kernel(
        cells: integers, ptr: integers, rows: integers, first: integers, number: integers, others: integers,
        row: integers, col: integers, begin: integers,
    ):  # fmt: skip
        ti.loop_config(serialize=True)
        for _ in range(1):
            n, j, blocks = ptr.shape[0] - 1, 0, 0
            while j < n:  # `first` is where the next number of each vertex goes
                first[j] = k * ptr[j]
                j += 1
            j = 0
            while j < n:
                r, last = ptr[j], ptr[j + 1]
                while r < last:
                    corner = rows[r]
                    c = corner % k
                    begins = corner - c
                    for a in ti.static(range(k)):
                        i = cells[begins + a]
                        at = first[i]
                        others[at], number[at] = j, k * (begins + a) + c
                        first[i] = at + 1
                    r += 1
                j += 1
            i, at = 0, 0
            while i < n:
                last, before = k * ptr[i + 1], -1
                first[i] = blocks
                while at < last:
                    j = others[at]
                    if j != before:
                        row[blocks], col[blocks], begin[blocks] = i, j, at
                        blocks += 1
                        before = j
                    at += 1
                i += 1
            begin[blocks], first[n] = at, blocks

    return kernel


pairs_of_3, pairs_of_4 = _pairs(3), _pairs(4)


@ti.kernel
def find(ptr: integers, col: integers, row: integers, wanted: integers, found: integers):
    """The number of each entry in the rows of a sparse matrix; -1 where there is none."""
    ti.loop_config(serialize=True)
    for k in range(row.shape[0]):
        at, end, j = ptr[row[k]], ptr[row[k] + 1], wanted[k]
        while at < end and col[at] != j:
            at += 1
        found[k] = at if at < end else -1


@ti.kernel
def permuted(
    ptr: integers, col: integers, order: integers, place: integers, begin: integers, end: integers, out: integers,
):  # fmt: skip
    """A symmetric sparse matrix in another order; `place` is where each row is in it, -1 for those left out."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        n, i, room = order.shape[0], 0, 0
        while i < n:
            begin[i] = end[i] = room
            room += ptr[order[i] + 1] - ptr[order[i]]
            i += 1
        i = 0
        while i < n:
            at, last = ptr[order[i]], ptr[order[i] + 1]
            while at < last:
                p = place[col[at]]
                if p >= 0:
                    out[end[p]] = i
                    end[p] = end[p] + 1
                at += 1
            i += 1
        p, to = 0, 0
        while p < n:
            at, last = begin[p], end[p]
            begin[p] = to
            while at < last:
                out[to] = out[at]
                at += 1
                to += 1
            p += 1
        begin[n] = to


@ti.kernel
def ordered(
    ptr: integers, col: integers, order: integers, place: integers, row: integers, to: integers, start: integers,
    stride: integers, number: integers, blocks: integers, inner: integers, indptr: integers, indices: integers,
):  # fmt: skip
    """What `layout.ordered` is to find; `place` as above."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        n, i, end = order.shape[0], 0, 0
        while i < n:
            own, begin = order[i], end
            blocks[i] = begin
            at, last = ptr[own], ptr[own + 1]
            while at < last:
                p = place[col[at]]
                if p >= i:  # so few are in a row that each is put where it belongs
                    k = end
                    while k > begin and inner[k - 1] > p:
                        inner[k], number[k] = inner[k - 1], number[k - 1]
                        k -= 1
                    inner[k], number[k] = p, at
                    end += 1
                at += 1
            first, step, k = 9 * begin, 3 * (end - begin), begin
            indptr[3 * i], indptr[3 * i + 1], indptr[3 * i + 2] = first, first + step, first + 2 * step
            while k < end:
                j = inner[k]
                row[k], to[k], start[k], stride[k] = own, order[j], first, step
                for a, b in ti.static(ti.ndrange(3, 3)):
                    indices[first + a * step + b] = 3 * j + b
                first += 3
                k += 1
            i += 1
        blocks[n], indptr[3 * n] = end, 9 * end


@ti.kernel
def chosen(ptr: integers, numbers: integers, which: integers, begin: integers, out: integers):
    """Some rows of numbers, one behind the other."""
    ti.loop_config(serialize=True)
    for k in range(which.shape[0]):
        at, to, end = ptr[which[k]], begin[k], begin[k + 1]
        while to < end:
            out[to] = numbers[at]
            at += 1
            to += 1


@ti.kernel
def columns(col: integers, start: integers, stride: integers, out: integers):
    """The column of each number in 3x3 blocks."""
    ti.loop_config(serialize=True)
    for k in range(col.shape[0]):
        j, first, step = 3 * col[k], start[k], stride[k]
        for a, b in ti.static(ti.ndrange(3, 3)):
            out[first + a * step + b] = j + b
