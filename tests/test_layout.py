"""What kernels find of a mesh's structure is what NumPy finds, and what asking pair by pair does, to the bit."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import scipy.sparse as sp

from muslin import mesh
from muslin.base import runtime
from muslin.base.launch import Launch, once
from muslin.physics import bending
from muslin.physics.elements import layout
from muslin.physics.elements.layout import grouped
from muslin.solve import cholmod


def cells():
    """Triangles and tetrahedra, in and out of order; an edge of three triangles; a vertex of none."""
    rng = np.random.default_rng(4)
    for triangles in (mesh.grid(5, 4).triangles, mesh.unstructured(1, 1, 0.15).triangles):
        yield triangles, int(triangles.max()) + 1
        yield rng.permuted(rng.permutation(triangles), axis=1), int(triangles.max()) + 3
    yield np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]], dtype=np.int32), 5
    yield np.array([[0, 1, 2, 3], [1, 4, 2, 3], [5, 4, 2, 1]], dtype=np.int32), 6
    yield rng.permuted(np.tile(np.arange(40), (30, 1)), axis=1)[:, :4].astype(np.int32), 40


@pytest.fixture(params=["kernels", "numpy"])
def by(request, monkeypatch):
    runtime.start()
    if request.param == "numpy":
        monkeypatch.setattr(runtime, "on_cpu", lambda: False)
        monkeypatch.setattr(runtime, "plain", lambda: False)
    return request.param


def test_the_pairs_of_corners_are_those_that_asking_one_by_one_finds(by):
    for each, n in cells():
        k, wanted = each.shape[1], {}
        for e, cell in enumerate(each.tolist()):
            for a, b in itertools.product(range(k), repeat=2):
                wanted.setdefault((cell[a], cell[b]), []).append(k * k * e + k * a + b)
        corners, ptr = grouped(each.ravel(), n)
        row, col, numbers, begin, first = layout.pairs(each, ptr, corners)
        assert np.array_equal(first, np.searchsorted(row, np.arange(n + 1)))
        assert list(zip(row.tolist(), col.tolist(), strict=True)) == sorted(wanted)
        assert [numbers[a:b].tolist() for a, b in itertools.pairwise(begin)] == [
            wanted[ij] for ij in sorted(wanted)
        ]


def symmetric(n, rng):
    i, j = rng.integers(0, n, (2, 3 * n))
    graph = sp.csr_matrix((np.ones(6 * n), (np.append(i, j), np.append(j, i))), shape=(n, n)) + sp.identity(n)
    graph.sort_indices()
    return graph.tocsr()


def test_a_permuted_graph_is_its_dense_matrix_permuted(by):
    rng = np.random.default_rng(1)
    for n in (1, 2, 30):
        graph = symmetric(n, rng)
        dense = graph.toarray() != 0
        for order in (np.arange(n), rng.permutation(n), rng.permutation(n)[: n // 2 + 1]):
            ptr, col = layout.permuted(graph, order)
            i, j = np.nonzero(dense[np.ix_(order, order)])
            assert np.array_equal(col, j)
            assert np.array_equal(ptr, np.searchsorted(i, np.arange(len(order) + 1)))


def test_blocks_in_an_order_of_elimination_are_where_its_scalar_matrix_has_them(by):
    rng = np.random.default_rng(7)
    graph = symmetric(20, rng)
    rows = np.repeat(np.arange(20), np.diff(graph.indptr))
    for order in (np.arange(20), rng.permutation(20), rng.permutation(20)[:9]):
        where, (ptr, col), (indptr, indices) = layout.ordered(graph, order)
        wanted = np.triu(graph.toarray()[np.ix_(order, order)])
        assert np.array_equal(np.repeat(np.arange(len(order)), np.diff(ptr)), np.nonzero(wanted)[0])
        assert np.array_equal(col, np.nonzero(wanted)[1])
        assert np.array_equal([where.row, where.col], [rows[where.number], graph.indices[where.number]])
        data = np.zeros(where.size)
        for a, b in itertools.product(range(3), repeat=2):
            data[where.start + a * where.stride + b] = 9 * where.number + 3 * a + b + 1
        n = 3 * len(order)
        found = sp.csr_matrix((data, indices, indptr), shape=(n, n)).toarray().reshape(-1, 3, len(order), 3)
        numbers = sp.csr_matrix((np.arange(len(rows)), graph.indices, graph.indptr), shape=(20, 20)).toarray()
        numbers = numbers[np.ix_(order, order)][:, None, :, None] * 9
        numbers = numbers + (1 + np.arange(9)).reshape(1, 3, 1, 3)
        assert np.array_equal(found, np.where(wanted[:, None, :, None] != 0, numbers, 0))


def test_entries_and_rows_are_found_where_they_are(by):
    graph = symmetric(30, np.random.default_rng(2))
    ptr, col = graph.indptr.astype(np.int32), graph.indices.astype(np.int32)
    i, j = (part.ravel() for part in np.mgrid[:30, :30])
    found = layout.find(ptr, col, i, j)
    assert np.array_equal(found >= 0, graph.toarray().ravel() != 0)
    assert np.array_equal(found[found >= 0], np.arange(len(col)))
    which = np.array([3, 3, 0, 29, 7])
    begin, numbers = layout.chosen(ptr, col, which)
    rows = [col[ptr[k] : ptr[k + 1]] for k in which]
    assert np.array_equal(numbers, np.concatenate(rows))
    assert np.diff(begin).tolist() == [len(row) for row in rows]
    nothing = which[:0]
    assert len(layout.find(ptr, col, nothing, nothing)) == len(layout.chosen(ptr, col, nothing)[1]) == 0


def test_a_layout_has_the_columns_of_the_matrix_with_3x3_blocks(by):
    graph = symmetric(20, np.random.default_rng(3))
    indptr, indices = layout.Layout.of(graph).scalar(20)
    wanted = sp.kron(graph, np.ones((3, 3)), format="csr")
    wanted.sort_indices()
    assert np.array_equal(indptr, wanted.indptr)
    assert np.array_equal(indices, wanted.indices)


@pytest.mark.parametrize("quick", [False, True])
@pytest.mark.parametrize("model", ["quadratic", "shells"])
def test_hinges_found_hinge_by_hinge_are_those_found_column_by_column(monkeypatch, model, quick):
    import muslin
    from muslin.physics.elements.bending import Bending

    rng = np.random.default_rng(5)
    runtime.start()
    for sheet in (mesh.grid(12, 9, diagonals="zigzag"), mesh.unstructured(1, 1, 0.08)):
        X = sheet.vertices + 0.01 * rng.standard_normal(sheet.vertices.shape)
        found = []
        for plain in (True, False):
            with monkeypatch.context() as patched:
                patched.setattr(runtime, "on_cpu", lambda plain=plain: plain)
                patched.setattr(runtime, "plain", lambda plain=plain: plain)
                hinges = bending.Hinges.of(X, sheet.triangles, quick)
            with monkeypatch.context() as patched:
                body = muslin.Cloth((X, sheet.triangles), mu=1.0, lam=1.0)
                patched.setattr(runtime, "plain", lambda plain=plain: plain)
                bent = Bending(X, hinges, model, 1e-3, exact=False)
                quadratic = model == "quadratic"
                beyond = bent.beyond(np.sin(X)) if quadratic else np.zeros(0)
                found.append((hinges, bent.factors(body.pattern) if quadratic else np.zeros(0), beyond))
        (one, factors, beyond), (other, too, beyond_too) = found
        for name in ("cells", "length", "area", "angle", "cotangents"):
            assert np.array_equal(getattr(one, name), getattr(other, name)), name
        if quick:  # sums in another order
            np.testing.assert_allclose(one.weight, other.weight, rtol=1e-9)
            for a, b in ((factors, too), (beyond, beyond_too)):
                np.testing.assert_allclose(a, b, rtol=1e-9, atol=1e-9 * np.abs(a).max(initial=0))
        else:
            assert np.array_equal(one.weight, other.weight)
            assert np.array_equal(factors, too)
            assert np.array_equal(beyond, beyond_too)


def test_a_mesh_without_an_inner_edge_has_no_hinges(by):
    for triangles in (np.array([[0, 1, 2]]), np.array([[0, 1, 2], [2, 3, 4]])):
        assert len(bending.inner_edges(triangles.astype(np.int32))) == 0


@pytest.mark.skipif(not cholmod.available(), reason="another build of CHOLMOD")
def test_a_matrix_analysed_by_blocks_is_solved_like_the_dense_one():
    rng = np.random.default_rng(6)
    for n in (1, 5, 60):
        graph = symmetric(n, rng)
        inner, (ptr, col), (indptr, indices) = layout.ordered(graph, rng.permutation(n))
        data = rng.standard_normal(inner.size)
        upper = np.triu(sp.csr_matrix((data, indices, indptr), shape=(3 * n, 3 * n)).toarray())
        dense = upper + np.triu(upper, 1).T
        shift = 1 - np.linalg.eigvalsh(dense)[0]
        own = sp.csr_matrix((np.arange(len(data)), indices, indptr), shape=dense.shape).diagonal()
        data[own] += shift
        domain = cholmod.Domain(indptr, indices, data, blocks=(ptr, col))
        b = rng.standard_normal(3 * n)
        for _ in range(2):
            domain.factorise()
            np.testing.assert_allclose(
                domain.solve(b), np.linalg.solve(dense + shift * np.eye(3 * n), b), rtol=1e-8
            )


def test_a_kernel_bound_before_is_bound_to_other_arrays_and_refuses_other_kinds():
    runtime.start()
    from muslin.physics.elements.layout_kernels import chosen

    def arrays(n):
        ptr = np.arange(n + 1, dtype=np.int32)
        return ptr, 7 * ptr[:-1], np.arange(n, dtype=np.int32), ptr.copy(), np.zeros(n, dtype=np.int32)

    for n in (3, 10, 1, 10):
        given = arrays(n)
        once(chosen, *given)
        assert np.array_equal(given[-1], 7 * np.arange(n))
        launch = Launch(chosen, *given)
        for _ in range(3):
            given[-1][:] = 0
            launch()
            assert np.array_equal(given[-1], 7 * np.arange(n))
    wrong = list(arrays(10))
    for bad in (wrong[1].reshape(5, 2), np.zeros(20, dtype=np.int32)[::2]):
        with pytest.raises(Exception, match=r"(?i)argument|array|contiguous|dim"):
            once(chosen, *[bad if k == 1 else value for k, value in enumerate(wrong)])
