"""The BLAS of others: which kernels CHOLMOD's takes, how many threads NumPy's wakes."""

import ctypes

import numpy as np
import pytest

from muslin.base import blas
from muslin.physics.elements.element import PARTS
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.integrators import steps
from muslin.solve import cholmod, kernels


@pytest.mark.parametrize(
    ("core", "flags", "expected"),
    [
        ("Prescott", {"sse3", "avx2", "fma"}, "Haswell"),
        ("Prescott", {"sse3", "avx2"}, None),
        ("Prescott", set(), None),
        ("SkylakeX", {"avx2", "fma", "avx512f"}, None),
        ("Zen", {"avx2", "fma"}, None),
    ],
)
def test_kernels_are_exchanged_only_where_openblas_does_not_know_the_processor(core, flags, expected):
    assert kernels.better(core, flags) == expected


def a_step(name, **values):
    model, state = simulation.build(scenes.get(name, **values))
    moving = steps(model, state, 1 / 100, "backward-euler")
    next(moving)
    return model, next(moving)


def test_a_solids_kernels_are_given_back_and_a_sheet_keeps_its_bits(monkeypatch):
    if not cholmod.available():
        pytest.skip("CHOLMOD cannot be called directly here")
    chosen = ctypes.c_void_p.in_dll(cholmod._library().kernels, "gotoblas")
    before = chosen.value
    sheet = a_step("hang", mesh="grid", resolution=6)[1].x
    fast = a_step("beam", resolution=3)[1].x
    assert chosen.value == before
    np.testing.assert_array_equal(a_step("hang", mesh="grid", resolution=6)[1].x, sheet)
    monkeypatch.setattr(kernels, "_switch", lambda blas: None)
    np.testing.assert_allclose(a_step("beam", resolution=3)[1].x, fast, rtol=0, atol=1e-12)


def test_numpys_threads_sleep_while_a_step_is_computed_and_are_then_as_before(monkeypatch):
    asked = blas._threads()
    if asked is None:
        pytest.skip("NumPy's BLAS is no OpenBLAS that lets itself be told")
    count, set_count = asked
    before = count()
    set_count(2)
    try:
        if count() != 2:
            pytest.skip("this OpenBLAS has one thread only")
        with blas.one_thread():
            assert count() == 1
        assert count() == 2
    finally:
        set_count(before)


def test_backward_euler_computes_no_hessian_that_it_does_not_solve_with():
    model, state = simulation.build(scenes.get("beam", resolution=3))
    element, solve, counts = model.body.elements["hessian"], model.system.solve, {"hessian": 0, "solved": 0}
    run = element._run

    def counted(parts, project):
        counts["hessian"] += bool(parts & PARTS["hessian"])
        run(parts, project)

    def solving(*given):
        counts["solved"] += 1
        return solve(*given)

    element._run, model.system.solve = counted, solving
    moving = steps(model, state, 1 / 100, "backward-euler")
    for _ in range(4):
        next(moving)
    assert counts["hessian"] == counts["solved"] > 3
