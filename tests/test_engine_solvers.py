"""Solvers: all of them solve the same system, in one piece or in two halves, and say when they cannot."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin.base.errors import SimulationError
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.solve import beside, cholmod, ordering, solvers
from muslin.solve.solvers import System

DIRECT = ["cholmod", "multifrontal", "superlu"]


def a_system(size, solver, held=(), project=True, **options):
    """System matrix of a stretched sheet in a solver's own layout, and as a scipy matrix."""
    scene = scenes.get("throw", mesh="grid", resolution=size, pinned="none", project=project)
    model, state = simulation.build(replace_solver(scene, solver))
    x = state.x * (1.1, 0.95, 1.0) + 1e-3 * np.random.default_rng(0).normal(size=state.x.shape)
    fixed = np.zeros(len(x), bool)
    fixed[list(held)] = True
    blocks = model.body.pattern.layout
    system = System(blocks.row, blocks.col, fixed, solver, project, model.body.X, **options)
    model.body.update(x)
    model.body.prepare("hessian", project=project)
    model.body.assembly(system.layout, system.data)(1e-6)
    K = model.body.stiffness_here(project)
    return system, model.body.pattern.matrix(model.body.mass_data + 1e-6 * K)


def replace_solver(scene, solver):
    from dataclasses import replace

    return replace(scene, solver=solver)


@pytest.fixture(params=[*DIRECT, "cg"])
def solver(request):
    if request.param == "cholmod":
        pytest.importorskip("cvxopt")
    return request.param


@pytest.mark.parametrize("size", [2, 7, 40])
def test_every_solver_solves_what_the_cloth_assembles(solver, size):
    held = range(size, 2 * size) if size > 2 else ()
    system, A = a_system(size, solver, held, tolerance=1e-13)
    rng = np.random.default_rng(1)
    b, known = rng.normal(size=(2, size * size, 3))
    y = system.solve(b)
    free = np.repeat(~system.pinned, 3)
    np.testing.assert_array_equal(y[system.pinned], 0.0)
    scale = np.abs(b).max()
    assert np.abs((A @ y.ravel() - b.ravel())[free]).max() < 1e-9 * scale
    again = system.solve(b)
    np.testing.assert_array_equal(y, again)
    assert system.solve(b, known)[system.pinned] == pytest.approx(known[system.pinned])


@pytest.mark.parametrize("tolerance", [1e-3, 1e-6, 1e-10])
def test_the_tolerance_bounds_the_residual(tolerance):
    system, A = a_system(20, "cg", tolerance=tolerance)
    b = np.random.default_rng(2).normal(size=(400, 3))
    y = system.solve(b)
    residual = np.linalg.norm(A @ y.ravel() - b.ravel()) / np.linalg.norm(b)
    assert residual <= 1.01 * tolerance
    cold = system.solver.iterations
    system.solve(b, guess=y)
    assert system.solver.iterations <= 1 < cold, "a warm start has little left to do"


def test_a_loose_tolerance_is_seen_in_the_motion_and_a_tight_one_is_not():
    exact = muslin.simulate("throw", mesh="grid", resolution=12, steps=10, solver="superlu").x

    def off(tolerance):
        run = muslin.simulate("throw", mesh="grid", resolution=12, steps=10, solver="cg", tolerance=tolerance)
        return np.abs(run.x - exact).max()

    assert off(1e-12) < 1e-9 < off(1e-3) < 1e-2


def test_conjugate_gradients_find_the_same_contacts_as_direct_solvers():
    """What presses hangs on small numbers: with a residual of 1e-8 this cloth lies 4 mm elsewhere after a second."""
    direct, iterative = (
        muslin.simulate("drape", resolution=10, steps=60, solver=solver).x for solver in ("auto", "cg")
    )
    assert np.abs(direct - iterative).max() < 1e-5


def test_conjugate_gradients_say_when_they_cannot():
    system, _ = a_system(12, "cg", project=False)
    system.data *= -1
    with pytest.raises(SimulationError, match="Conjugate gradients stopped"):
        system.solve(np.ones((144, 3)))


def test_auto_iterates_only_where_factors_would_not_fit():
    assert solvers.choose("auto", 40_000) in DIRECT
    assert solvers.choose("auto", solvers.LARGE) == "cg"


@pytest.mark.skipif(not cholmod.available(), reason="another build of CHOLMOD")
def test_two_halves_are_one_whole(monkeypatch):
    halves, _ = a_system(40, "cholmod", range(40))
    assert hasattr(halves.solver._solve, "_halves")
    monkeypatch.setattr(ordering, "HALVES", 10**9)
    whole, _ = a_system(40, "cholmod", range(40))
    monkeypatch.setattr(cholmod, "available", lambda: False)
    wrapped, _ = a_system(40, "cholmod", range(40))
    b = np.random.default_rng(3).normal(size=(1600, 3))
    y = whole.solve(b)
    np.testing.assert_allclose(halves.solve(b), y, atol=1e-9 * np.abs(y).max())
    np.testing.assert_allclose(wrapped.solve(b), y, atol=1e-9 * np.abs(y).max())
    alone = halves.solve(b)
    halves.solver._solve._halves.parallel ^= True
    np.testing.assert_array_equal(halves.solve(b), alone)


@pytest.mark.parametrize("size", [7, 40])
def test_a_matrix_that_was_factorised_is_solved_with_again(solver, size):
    system, matrix = a_system(size, solver, held=[0, 3])
    rng = np.random.default_rng(5)
    b, c = rng.standard_normal((2, size * size, 3))
    system.solve(b)
    y = system.again(c)
    assert np.abs(y - system.solve(c)).max() <= 1e-6 * np.abs(y).max()
    free = np.repeat(~system.pinned, 3)
    left = (matrix @ y.ravel() - c.ravel())[free]
    assert not y[system.pinned].any()
    assert np.abs(left).max() < 1e-5 * np.abs(c).max()


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize("size", [10, 40])
def test_an_indefinite_matrix_is_still_solved(size, solver):
    if solver == "cholmod":
        pytest.importorskip("cvxopt")
    system, A = a_system(size, solver, project=False)
    at = system.layout.row == system.layout.col
    start, stride = system.layout.start[at], system.layout.stride[at]
    diagonal = A.diagonal()
    shift = 0.5 * diagonal.max()
    for a in range(3):
        system.data[start + a * (stride + 1)] -= shift
    b = np.random.default_rng(4).normal(size=(size * size, 3))
    y = system.solve(b)
    assert np.abs(A @ y.ravel() - shift * y.ravel() - b.ravel()).max() < 1e-6 * np.abs(b).max()


def random_system(n, seed, pieces=1):
    """A positive definite matrix of 3x3 blocks on a random graph in pieces, not that of any mesh."""
    rng = np.random.default_rng(seed)
    piece = rng.integers(pieces, size=n)
    i, j = rng.integers(n, size=(2, 3 * n))
    kept = (piece[i] == piece[j]) & (i != j)
    pairs = np.unique(np.sort(np.stack([i, j])[:, kept], axis=0), axis=1)
    dense = np.zeros((n, n, 3, 3))
    for a, b in pairs.T:
        dense[a, b] = rng.normal(size=(3, 3))
        dense[b, a] = dense[a, b].T
    dense[np.arange(n), np.arange(n)] = 40 * np.eye(3)
    row, col = np.nonzero(np.abs(dense).sum(axis=(2, 3)))
    return row, col, dense


@pytest.mark.parametrize("solver", DIRECT)
@pytest.mark.parametrize(("n", "pieces"), [(1, 1), (2, 2), (9, 1), (60, 3), (200, 1), (900, 7)])
def test_any_graph_is_solved_that_of_a_mesh_or_not(solver, n, pieces):
    """Also one in several pieces, and one that is too dense to be cut in two."""
    if solver == "cholmod":
        pytest.importorskip("cvxopt")
    row, col, dense = random_system(n, seed=n, pieces=pieces)
    for held in (np.zeros(n, bool), np.arange(n) % 5 == 1, np.ones(n, bool)):
        system = System(row, col, held, solver)
        for layout, out in (
            (system.layout, system.data),
            (system.coupling, coupling := np.zeros(system.coupling.size)),
        ):
            for a in range(3):
                for b in range(3):
                    out[layout.start + a * layout.stride + b] = dense[layout.row, layout.col, a, b]
        b, known = np.random.default_rng(5).normal(size=(2, n, 3))
        y = system.solve(b, known, coupling)
        np.testing.assert_array_equal(y[held], known[held])
        residual = dense.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n) @ y.ravel() - b.ravel()
        assert np.abs(residual.reshape(n, 3)[~held]).max(initial=0.0) < 1e-12 * 40


@pytest.mark.parametrize("size", [12, 40])
def test_fronts_give_the_same_bits_on_one_thread_and_on_two(size):
    """The sums of the halves are kept apart until both are done, whoever does them."""
    code = f"""
import sys, numpy as np
from muslin.base import runtime
runtime.start(threads=int(sys.argv[1]))
sys.path.insert(0, {str(Path(__file__).parent)!r})
from test_engine_solvers import a_system
system, _ = a_system({size}, "multifrontal", range({size}))
y = system.solve(np.random.default_rng(6).normal(size=({size}**2, 3)))
assert np.abs(y).max() > 0
print(len(system.solver.plan.tasks) - 2, y.tobytes().hex())
"""
    told = [
        subprocess.run([sys.executable, "-c", code, n], capture_output=True, text=True, check=True).stdout
        for n in ("1", "2")
    ]
    assert told[0] == told[1]
    assert told[0].startswith("1 " if size == 12 else "2 ")


def test_a_task_goes_on_to_its_end_when_the_wait_for_it_is_interrupted():
    """Ctrl-C while one half is factorised must not mix its numbers with the next system's."""
    helper, done = beside.Helper(), []

    def slow():
        time.sleep(0.2)
        done.append("first")
        raise ValueError("of the first")

    helper.start(slow)  # and nobody waits for it
    helper.start(lambda: done.append("second"))
    helper.wait()
    assert done == ["first", "second"]
    helper.start(lambda: 1 // 0)
    with pytest.raises(ZeroDivisionError):
        helper.wait()


def test_all_cuts_of_one_depth_at_once_are_those_made_one_by_one():
    import scipy.sparse as sp

    def one_by_one(graph, points, vertices, leaf):
        if len(vertices) <= leaf:
            return [vertices]
        *parts, separator = ordering.cut(graph, points, vertices)
        below = [node for part in parts if len(part) for node in one_by_one(graph, points, part, leaf)]
        return [*below, separator]

    rng = np.random.default_rng(3)
    for n, edges in ((300, 700), (60, 500), (200, 100), (1, 0)):
        i, j = rng.integers(0, n, (2, edges))
        ones = np.ones(2 * edges)
        graph = sp.csr_matrix((ones, (np.append(i, j), np.append(j, i))), shape=(n, n)) + sp.identity(n)
        for points in (rng.random((n, 3)), np.zeros((n, 3)), rng.integers(0, 3, (n, 3)).astype(float)):
            vertices = np.flatnonzero(rng.random(n) < 0.8) if n > 1 else np.arange(1)
            nodes, children = ordering.dissection(graph.tocsr(), points, vertices, 7)
            wanted = one_by_one(graph.tocsr(), points, vertices, 7)
            assert len(nodes) == len(wanted) == len(children)
            assert all(np.array_equal(a, b) for a, b in zip(nodes, wanted, strict=True))
            assert all(k < node for node, below in enumerate(children) for k in below)


@pytest.mark.skipif(not cholmod.available(), reason="orders are only compared for CHOLMOD")
def test_a_system_that_will_not_last_is_solved_as_well():
    from muslin.mesh import grid

    body = muslin.Cloth(grid(30, 30, diagonals="zigzag"), mu=1e3, lam=1e3)
    blocks, n = body.pattern.layout, len(body.X)
    b = np.random.default_rng(0).normal(size=(n, 3))
    found = []
    for lasting in (True, False):
        system = System(blocks.row, blocks.col, np.zeros(n, bool), "cholmod", points=body.X, lasting=lasting)
        assemble = body.assembly(system.layout, system.data)
        body.update(body.X * 1.01)
        body.prepare("hessian")
        assemble(0.01)
        found.append(system.solve(b).copy())
    assert np.abs(found[0] - found[1]).max() < 1e-12 * np.abs(found[0]).max() * n
    assert not np.array_equal(*found)  # another order, other rounding
