"""Bending against truth in many digits, cylinders, and the heavy elastica."""

from __future__ import annotations

import itertools

import mpmath as mp
import numpy as np
import pytest
from scipy.integrate import solve_bvp

import muslin
from muslin import mesh, simulation
from muslin.base.errors import MuslinError
from muslin.mesh import grid, unstructured
from muslin.physics.bending import Hinges, inner_edges
from muslin.simulation import scenes
from muslin.simulation.integrators import backward_euler, linearly_implicit_euler
from muslin.simulation.model import Model, State

FLAP = np.array([[0, 1, 2], [1, 0, 3]], dtype=np.int32)
MODELS = ["quadratic", "shells"]
SOFT = {"mu": 1e-30, "lam": 0.0}  # no membrane to speak of


def flaps():
    """Two triangles flat at rest and folded at rest, each bent away from that."""
    rng = np.random.default_rng(3)
    flat = np.array([[0, 0, 0], [1, 0.1, 0], [0.4, 0.8, 0], [0.7, -0.6, 0]], float)
    for rest in (flat, flat + np.outer([0, 0, 0.3, 0.2], [0, 0, 1])):
        for size in (1e-3, 0.1, 0.7):
            yield rest, rest + size * rng.standard_normal((4, 3))


def unit(v):
    return v / mp.sqrt((v.T * v)[0])


def cross(a, b):
    return mp.matrix([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def dot(a, b):
    return (a.T * b)[0]


def fold(x):
    """Edge vector, and the angle between the two triangles."""
    x0, x1, x2, x3 = (mp.matrix(list(x[3 * k : 3 * k + 3])) for k in range(4))
    n, m = unit(cross(x1 - x0, x2 - x0)), unit(cross(x3 - x0, x1 - x0))
    edge = x1 - x0
    return edge, mp.atan2(dot(cross(n, m), unit(edge)), dot(n, m))


def true_energy(model, rest, weight, x):
    """k/2 w (|e| (theta - theta_0))^2, or k/2 w |sum_i c_i x_i|^2 with cotangents of the corners' angles; k = 1."""
    if model == "shells":
        edge, angle = fold(rest)
        return weight / 2 * dot(edge, edge) * (fold(x)[1] - angle) ** 2
    X = [mp.matrix(list(rest[3 * k : 3 * k + 3])) for k in range(4)]

    def cotangent(at, to, beside):
        a, b = X[to] - X[at], X[beside] - X[at]
        c = cross(a, b)
        return dot(a, b) / mp.sqrt(dot(c, c))

    near0, near1 = [[cotangent(at, 1 - at, opposite) for opposite in (2, 3)] for at in (0, 1)]
    c = [sum(near1), sum(near0), -near0[0] - near1[0], -near0[1] - near1[1]]
    return weight / 2 * sum(sum(c[k] * x[3 * k + a] for k in range(4)) ** 2 for a in range(3))


def derivatives(f, x):
    """Gradient and Hessian by differences of numbers of 60 digits: right to some 28."""
    with mp.workdps(60):
        step, n = mp.mpf(10) ** -15, len(x)
        x = [mp.mpf(float(v)) for v in x]

        def at(*moves):
            moved = list(x)
            for k, sign in moves:
                moved[k] += sign * step
            return f(moved)

        gradient = [(at((k, 1)) - at((k, -1))) / (2 * step) for k in range(n)]
        hessian = np.zeros((n, n))
        for i, j in itertools.combinations_with_replacement(range(n), 2):
            signs = itertools.product((1, -1), repeat=2)
            second = sum(a * b * at((i, a), (j, b)) for a, b in signs) / (4 * step**2)
            hessian[i, j] = hessian[j, i] = float(second)
        return float(f(x)), np.array([float(g) for g in gradient]), hessian


@pytest.mark.parametrize("model", MODELS)
def test_energy_gradient_and_hessian_of_a_hinge_are_right_to_rounding(model):
    for rest, x in flaps():
        body = muslin.Cloth((rest, FLAP), **SOFT, bending=model, bending_stiffness=1.0)
        hinges = Hinges.of(rest, FLAP)
        # the body numbers the corners of its one hinge as it likes
        corners = hinges.cells[0]
        with mp.workdps(60):
            laid = [mp.mpf(float(v)) for v in rest[corners].ravel()]
            weight = mp.mpf(float(hinges.weight[0]))
            energy, gradient, hessian = derivatives(
                lambda y, laid=laid, weight=weight: true_energy(model, laid, weight, y), x[corners].ravel()
            )
        rows = (3 * corners[:, None] + np.arange(3)).ravel()
        assert body.energy(x) == pytest.approx(energy, rel=1e-12)
        found = body.gradient(x).ravel()[rows]
        assert np.abs(found - gradient).max() < 1e-12 * np.abs(gradient).max()
        found = body.hessian(x).toarray()[np.ix_(rows, rows)]
        assert np.abs(found - hessian).max() < 1e-12 * np.abs(hessian).max()


@pytest.mark.parametrize("model", MODELS)
def test_a_projected_hessian_is_positive_semi_definite_and_no_less_than_the_exact_one(model):
    for rest, x in flaps():
        body = muslin.Cloth((rest, FLAP), **SOFT, bending=model, bending_stiffness=1.0)
        exact, clamped = body.hessian(x).toarray(), body.hessian(x, project=True).toarray()
        size = np.abs(exact).max()
        assert np.linalg.eigvalsh(clamped).min() > -1e-13 * size
        assert np.linalg.eigvalsh(clamped - exact).min() > -1e-13 * size
        assert np.abs(clamped).max() < 10 * size


@pytest.mark.parametrize("model", MODELS)
def test_moving_and_turning_a_sheet_bends_nothing(model):
    cloth, rng = unstructured(1, 1, 0.2), np.random.default_rng(0)
    bent = cloth.vertices + np.array([0, 0, 0.1]) * np.sin(5 * cloth.vertices[:, :1])
    body = muslin.Cloth(cloth, **SOFT, bending=model, bending_stiffness=1.0)
    turn, _ = np.linalg.qr(rng.standard_normal((3, 3)))
    turn *= np.linalg.det(turn)
    there = bent @ turn.T + [3, -2, 5]
    np.testing.assert_allclose(body.gradient(there), body.gradient(bent) @ turn.T, atol=1e-11)
    assert body.energy(there) == pytest.approx(body.energy(bent), rel=1e-12)
    flat = cloth.vertices @ turn.T + [3, -2, 5]
    assert body.energy(flat) < 1e-26
    assert np.abs(body.gradient(flat)).max() < 1e-11
    force = body.gradient(bent)
    assert np.abs(force.sum(axis=0)).max() < 1e-12 * np.abs(force).max()
    moment = np.cross(bent, force).sum(axis=0)
    assert np.abs(moment).max() < 1e-11 * np.abs(np.cross(bent, force)).sum()


@pytest.mark.parametrize("make", [lambda: grid(12, 12, diagonals="zigzag"), lambda: unstructured(1, 1, 0.1)])
def test_both_models_agree_for_small_angles(make):
    cloth = make()
    X = cloth.vertices
    bent = X + 1e-4 * np.sin(3 * X[:, :1] + 2 * X[:, 1:2]) * [0, 0, 1]
    energies, gradients = zip(
        *(
            (body.energy(bent), body.gradient(bent)[:, 2])
            for body in (muslin.Cloth(cloth, **SOFT, bending=m, bending_stiffness=1.0) for m in MODELS)
        ),
        strict=True,
    )
    assert energies[0] == pytest.approx(energies[1], rel=1e-6)
    np.testing.assert_allclose(*gradients, atol=1e-6 * np.abs(gradients[0]).max())


def rolled(X, radius, degrees):
    """A sheet in the plane z = 0, laid around a cylinder whose axis is across this direction."""
    across = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0.0])
    along = np.cross([0, 0, 1.0], across)
    s = X @ across
    around = radius * np.sin(s / radius)[:, None] * across
    return around + (X @ along)[:, None] * along + radius * (1 - np.cos(s / radius))[:, None] * [0, 0, 1.0]


def cylinder(cloth, model, degrees):
    """Bending energy on a cylinder, of what it should be: k/2 A / r^2."""
    body = muslin.Cloth(cloth, **SOFT, bending=model, bending_stiffness=2.0)
    return body.energy(rolled(cloth.vertices, 0.7, degrees)) / (2.0 / 2 * body.area.sum() / 0.7**2)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("degrees", [0, 30, 45, 90, 135])
@pytest.mark.parametrize(
    "make",
    [lambda n: grid(n + 1, n + 1, diagonals="zigzag"), lambda n: unstructured(1, 1, 1 / n)],
    ids=["structured", "unstructured"],
)
def test_the_energy_of_a_cylinder_converges_to_its_closed_form_whatever_its_direction(make, degrees, model):
    off = [abs(cylinder(make(n), model, degrees) - 1) for n in (12, 24, 48)]
    assert off[2] < 0.035
    assert off[2] < 0.75 * off[0] or off[0] < 0.02


def test_quick_weights_give_a_refined_sheet_the_energy_of_a_cylinder_in_every_direction():
    from muslin.mesh import Refinement
    from muslin.mesh.surface import frozen

    begun, rng = grid(13, 13, diagonals="zigzag"), np.random.default_rng(2)
    refined = Refinement.of(begun)
    for _ in range(4):
        refined = refined.refine(rng.integers(0, len(refined.triangles), len(refined.triangles) // 5))
    cloth = frozen(refined.spread(begun.vertices), refined.triangles, "refined")

    def off(lasting):
        model = {"bending": "quadratic", "bending_stiffness": 2.0, "lasting": lasting}
        body = muslin.Cloth(cloth, **SOFT, **model)
        exact = 2.0 / 2 * body.area.sum() / 0.7**2
        return np.array(
            [body.energy(rolled(cloth.vertices, 0.7, degrees)) / exact - 1 for degrees in range(0, 180, 15)]
        )

    slowly, quickly = off(True), off(False)
    assert not np.array_equal(slowly, quickly)
    assert np.abs(quickly - slowly).max() < 0.03
    assert np.abs(quickly).max() < 1.1 * np.abs(slowly).max()


def elastica(length, weight, stiffness):
    """Where the tip of a heavy strip hangs that is clamped level: Euler's k theta'' = w (L - s) cos(theta)."""

    def slopes(s, y):
        return np.stack([y[1], weight * (length - s) * np.cos(y[0]) / stiffness, np.cos(y[0]), np.sin(y[0])])

    def ends(a, b):
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, length, 200)
    found = solve_bvp(slopes, ends, s, np.stack([s, 0 * s + 1, s, 0 * s]), tol=1e-8, max_nodes=20000)
    assert found.success
    return np.array([found.y[2, -1], found.y[3, -1]])


def hanging(cloth, length, model, stiffness):
    """Where the tip of a strip hangs that is held level at its left end, once it has come to rest."""
    X = cloth.vertices
    body = muslin.Cloth(cloth, mu=500.0, lam=0.0, rho=0.2, bending=model, bending_stiffness=stiffness)
    level = np.stack([X[:, 0], X[:, 2], X[:, 1]], axis=1)
    pinned = np.flatnonzero(X[:, 0] < 1e-9)
    there = Model(body, gravity=np.array([0, -9.81, 0]), pinned=pinned)
    state = State(level, np.zeros_like(X))
    body.update(state.x)
    for dt in [0.02] * 20 + [
        1.0
    ] * 8:  # slowly at first; then in steps so long that all motion is damped away
        state = backward_euler(there, State(state.x, 0 * state.v), dt)
        body.update(state.x)
    tip = np.abs(X[:, 0] - length) < 1e-9
    return state.x[tip].mean(axis=0)[:2]


@pytest.mark.parametrize("model", MODELS)
def test_a_clamped_strip_hangs_as_the_heavy_elastica(model):
    length, stiffness, off = 0.15, 4e-4, []
    for n in (8, 16, 32):
        h = length / n  # the first hinge is held at its left: the clamp is where its part of the strip begins
        made = grid(n + 2, 5, length + h, 4 * h, diagonals="zigzag")
        strip = mesh.Mesh.from_arrays(made.vertices + np.array([length / 2 - h / 2, 0, 0]), made.triangles)
        true = elastica(length + h / 2, 0.2 * 9.81, stiffness) - [h / 2, 0]
        off.append(np.linalg.norm(hanging(strip, length, model, stiffness) - true) / length)
    assert max(off) < 0.02
    assert off[-1] < 0.005
    assert off[2] < off[0]


def test_a_wide_strip_of_any_triangles_hangs_as_the_heavy_elastica_with_a_third_for_poisson_s_ratio():
    """Equilateral triangles have no choice: a free strip curls across, and is softer by 1 - 1/9."""
    held, length, stiffness, h = 0.02, 0.15, 4e-4, 0.006
    made = unstructured(length + held, 0.1, h)
    strip = mesh.Mesh.from_arrays(made.vertices + np.array([(length - held) / 2, 0, 0]), made.triangles)
    # the clamp is half a hinge behind the last vertex that is held
    true = elastica(length + h / 4, 0.2 * 9.81, stiffness * 8 / 9) - [h / 4, 0]
    assert np.linalg.norm(hanging(strip, length, "quadratic", stiffness) - true) < 0.02 * length


def loose(exact=True, model="quadratic"):
    """A bent sheet that flies and turns, and what moves it."""
    cloth = grid(9, 9, diagonals="zigzag")
    body = muslin.Cloth(
        cloth, mu=2e3, lam=2e3, rho=0.2, bending=model, bending_stiffness=1e-2, exact_bending=exact
    )
    x = rolled(cloth.vertices, 0.4, 20)
    v = np.cross([1.0, 2.0, 0.5], x) + np.array([0.3, 0.0, 1.0])
    body.update(x)
    return Model(body, gravity=np.array([0, -9.81, 0])), State(x, v)


def momenta(model, state):
    p = (model.body.mass @ state.v.ravel()).reshape(-1, 3)
    return p.sum(axis=0), np.cross(state.x - state.x.mean(axis=0), p).sum(axis=0)


def test_bending_pulls_at_no_sheet_as_a_whole():
    lost = []
    for exact in (True, False):
        model, state = loose(exact)
        before = momenta(model, state)
        for _ in range(20):
            state = linearly_implicit_euler(model, state, 1e-4)
            model.body.update(state.x)
        linear, angular = momenta(model, state)
        fallen = -9.81 * model.body.mass.sum() / 3 * 2e-3
        np.testing.assert_allclose(linear - before[0], [0, fallen, 0], atol=1e-12)
        lost.append(np.linalg.norm(angular - before[1]))
    # the integrator loses some, as it does without bending; what is left out of its matrix does not add to that
    assert lost[1] < 1.02 * lost[0] < 0.01 * np.linalg.norm(before[1])


def test_a_step_that_keeps_to_the_mesh_s_pattern_is_the_exact_one_to_second_order():
    off = []
    for dt in (2e-4, 1e-4, 5e-5):
        (one, a), (two, b) = loose(True), loose(False)
        assert two.body.pattern.nnz < one.body.pattern.nnz
        off.append(
            np.abs(linearly_implicit_euler(one, a, dt).v - linearly_implicit_euler(two, b, dt).v).max()
        )
    assert off[0] > 3.5 * off[1] > 3.5**2 * off[2]
    x = a.x + 0.01 * np.sin(np.arange(a.x.size)).reshape(-1, 3)
    np.testing.assert_allclose(
        one.body.hessian(x).toarray(),
        two.body.hessian(x).toarray(),
        atol=1e-9 * abs(one.body.hessian(x)).max(),
    )


def test_what_has_no_hinge_does_not_bend():
    single = muslin.Cloth((np.eye(3), [[0, 1, 2]]), mu=1.0, lam=1.0, bending="shells", bending_stiffness=1.0)
    assert single.energy(np.eye(3)) < 1e-30
    fan = np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]])  # three triangles at one edge
    assert inner_edges(fan[:2]).tolist() == [[0, 1, 2, 3]]
    assert len(inner_edges(fan)) == 0


def test_only_the_scenes_of_the_lecture_do_not_bend():
    bends = {name for name in scenes.CLOTHS if scenes.get(name).bending != "off"}
    assert bends == {"drape", "hang", "cape"}
    run = simulation.simulate("hang", resolution=6, steps=2)
    assert run.body.bending is not None
    assert simulation.simulate("hang", resolution=6, steps=2, bending="off").body.bending is None


def test_a_model_of_bending_that_does_not_exist_is_refused():
    with pytest.raises(MuslinError, match="bending = 'stiff' is not understood"):
        scenes.get("drape", bending="stiff")
    with pytest.raises(MuslinError, match="must not be negative"):
        scenes.get("drape", bending_stiffness=-1)
