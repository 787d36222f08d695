"""What a derivative is held to: right formulas pass however they are arranged, plain differences do not."""

import numpy as np
import pytest

from muslin import tasks
from muslin.judging import cases, judge, reference
from muslin.tasks.comparing import Limits, compare

DRAWS = (None, "one", "two", "three")


def cross(a, b):
    return np.cross(a, b)


def length(a):
    return np.linalg.norm(a, axis=-1)


def dots(a, b):
    return np.sum(a * b, axis=-1)


def multiplied_out(a, b, c):
    """(b - a) x (c - a)."""
    return cross(a, b) + cross(b, c) + cross(c, a)


def from_edges(a, b, c):
    """Twice the area by Heron's formula, lengths of edges by products of places."""
    p, q, r = (dots(u, u) + dots(v, v) - 2 * dots(u, v) for u, v in ((a, b), (b, c), (c, a)))
    return np.sqrt(4 * p * q - (p + q - r) ** 2) / 2


def dn_dx(m, area):
    def formula(x0, x1, x2, i):
        x = np.stack([x0, x1, x2])
        at = np.arange(len(i))
        e = x[(i + 2) % 3, at] - x[(i + 1) % 3, at]
        n = m(x0, x1, x2) / area(x0, x1, x2)[:, None]
        return cross(e, n)[:, :, None] * n[:, None, :] / area(x0, x1, x2)[:, None, None]

    return formula


def dphi_dX_multiplied_out(X0, X1, X2):
    m = multiplied_out(X0, X1, X2)
    rows = [cross(m, e) for e in (X2 - X1, X0 - X2, X1 - X0)]
    return np.stack(rows, axis=1) / dots(m, m)[:, None, None]


def dphi_dX_normal_equations(X0, X1, X2):
    D = np.stack([X1 - X0, X2 - X0], axis=2)
    G = np.linalg.inv(D.swapaxes(1, 2) @ D) @ D.swapaxes(1, 2)
    return np.concatenate([-G.sum(axis=1, keepdims=True), G], axis=1)


def dphi_dX_of_places(X0, X1, X2, X3):
    def triple(a, b, c):
        return dots(a, cross(b, c))

    volume = triple(X1, X2, X3) - triple(X0, X2, X3) + triple(X0, X1, X3) - triple(X0, X1, X2)
    faces = ((X1, X3, X2), (X0, X2, X3), (X0, X3, X1), (X0, X1, X2))
    return np.stack([multiplied_out(*face) for face in faces], axis=1) / volume[:, None, None]


def dphi_dX_inverse_of_four(X0, X1, X2, X3):
    places = np.stack([X0, X1, X2, X3], axis=2)
    return np.linalg.inv(np.concatenate([places, np.ones((len(X0), 1, 4))], axis=1))[:, :, :3]


def stress(F, C, D, J, G):
    C, D, J = (a[:, None, None] for a in (C, D, J))
    I1 = np.sum(F * F, axis=(1, 2))[:, None, None]
    return 2 * C * np.cbrt(J) ** -2.0 * (F - I1 / 3 * G) + 2 * D * (J - 1) * J * G


def stress_through_C(F, C, D):
    right = F.swapaxes(1, 2) @ F
    return stress(F, C, D, np.sqrt(np.linalg.det(right)), F @ np.linalg.inv(right))


def stress_through_eigenvectors(F, C, D):
    squares, V = np.linalg.eigh(F.swapaxes(1, 2) @ F)
    U = F @ V / np.sqrt(squares)[:, None, :]
    return stress(
        F, C, D, np.sqrt(squares.prod(axis=1)), (U / np.sqrt(squares)[:, None, :]) @ V.swapaxes(1, 2)
    )


def spring_of_places(x0, x1, l0, k):
    d, apart = x1 - x0, length(x1 - x0) > 0
    long = np.sqrt(np.maximum(dots(x0, x0) + dots(x1, x1) - 2 * dots(x0, x1), 0))
    share = np.where(apart, k * (long - l0) / np.where(apart, long, 1), 0)
    return share[:, None] * d


ARRANGED = {
    "normal multiplied out": ("cloth", "dn_dx", dn_dx(multiplied_out, lambda *x: length(multiplied_out(*x)))),
    "area from products of places": ("cloth", "dn_dx", dn_dx(multiplied_out, from_edges)),
    "multiplied out": ("cloth", "dphi_dX", dphi_dX_multiplied_out),
    "normal equations": ("cloth", "dphi_dX", dphi_dX_normal_equations),
    "volume of places": ("solids", "dphi_dX", dphi_dX_of_places),
    "inverse of a 4x4": ("solids", "dphi_dX", dphi_dX_inverse_of_four),
    "stress through C": ("solids", "dpsi_dF", stress_through_C),
    "stress through eigenvectors": ("solids", "dpsi_dF", stress_through_eigenvectors),
    "length of places": ("solids", "spring_force", spring_of_places),
}


def drawn(assignment, task, seed):
    """Inputs, answers, and what compares with them; the public cases, or twelve others."""
    entry, own = tasks.assignment(assignment).tasks[task], judge(assignment, task)
    if seed is None:
        inputs, expected = reference.cases(assignment, task)
    else:
        inputs = cases.draw_inputs(assignment, task, seed, 12)
        expected = cases.truth(assignment, task, inputs)

    def verdict(got, ease=1.0):
        limits = own.limits(inputs)
        limits = Limits(ease * limits.each, limits.spared)
        return compare(entry, got, expected, inputs, own.terms, limits)

    return inputs, verdict


@pytest.mark.parametrize("seed", DRAWS)
@pytest.mark.parametrize("name", ARRANGED)
def test_a_right_formula_passes_with_ten_times_to_spare_however_it_is_arranged(name, seed):
    assignment, task, formula = ARRANGED[name]
    inputs, verdict = drawn(assignment, task, seed)
    found = verdict(formula(**inputs), 0.1)
    assert found.ok, found.message


def test_the_digits_that_some_of_them_lose_are_more_than_others_may():
    """So the test above can fail: far from the origin, these lose what no single limit allows."""
    inputs, _ = drawn("cloth", "dn_dx", None)
    expected = reference.cases("cloth", "dn_dx")[1]
    entry = tasks.assignment("cloth").tasks["dn_dx"]
    got = dn_dx(multiplied_out, from_edges)(**inputs)
    assert not compare(entry, got, expected, inputs, None, Limits(1e-11)).ok


def differences(f, x, h, kind):
    """Differences of f (b, ...) in the entries of x (b, ...)."""
    columns = []
    for at in np.ndindex(x.shape[1:]):
        step = np.zeros_like(x)
        step[(slice(None), *at)] = h
        columns.append(
            (f(x + step) - f(x - step)) / (2 * h) if kind == "central" else (f(x + step) - f(x)) / h
        )
    found = np.stack(columns, axis=-1)
    return found.reshape(found.shape[:-1] + x.shape[1:])


def psi(F, C, D):
    J = np.linalg.det(F)
    return C * (np.sum(F * F, axis=(1, 2)) * np.cbrt(J) ** -2.0 - 3) + D * (J - 1) ** 2


def shares(X, X0, X1, X2, X3):
    E = np.stack([X1 - X0, X2 - X0, X3 - X0], axis=2)
    phi = np.linalg.solve(E, (X - X0)[:, :, None])[:, :, 0]
    return np.concatenate([1 - phi.sum(axis=1, keepdims=True), phi], axis=1)


DIFFERENCED = {
    "dphi_dX": ("solids", lambda a, h, kind: differences(lambda X: shares(X, **a), a["X0"], h, kind)),
    "dpsi_dF": ("solids", lambda a, h, kind: differences(lambda F: psi(F, a["C"], a["D"]), a["F"], h, kind)),
    "dpsi_ds": (
        "cloth",
        lambda a, h, kind: differences(
            lambda s: (
                a["mu"] * ((s[:, 0] - 1) ** 2 + (s[:, 1] - 1) ** 2)
                + a["lam"] / 2 * (s[:, 0] + s[:, 1] - 2) ** 2
            ),
            a["s"],
            h,
            kind,
        ),
    ),
}


@pytest.mark.parametrize("kind", ["central", "forward"])
@pytest.mark.parametrize("step", [1e-5, 1e-6, 1e-7, 1e-8])
@pytest.mark.parametrize("task", DIFFERENCED)
def test_plain_differences_do_not_pass_even_if_ten_times_as_much_were_allowed(task, step, kind):
    assignment, differenced = DIFFERENCED[task]
    for seed in (None, "one"):
        inputs, verdict = drawn(assignment, task, seed)
        assert not verdict(differenced(inputs, step, kind), 10).ok


def test_of_few_cases_a_library_may_leave_more_but_no_more_than_anyone():
    limits = Limits(1e-13, spared=0.5)
    errors = np.array([[0, 1e-14, 1e-10, 1e-10]])
    assert not limits.over(errors).any()
    assert limits.over(np.array([[0, 1e-10, 1e-10, 1e-10]])).tolist() == [False, True, True, True]
    assert limits.over(np.array([[0, 0, 1e-10, 2e-9]])).tolist() == [False, False, False, True]
