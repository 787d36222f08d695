"""Every student function against the truth: ten thousand triangles with cond(D) <= 10, and thinner ones."""

from pathlib import Path

import numpy as np
import pytest
import truth_fast as fast

import muslin
from muslin import given
from muslin.judging import exact as tr
from muslin.judging.knowledge import known

SOLUTION = Path(__file__).parents[1] / "solutions" / "cloth"
COUNT = 10_000

pytestmark = fast.needs_longdouble


def size(a):
    """Euclidean norm of each sample."""
    a = np.asarray(a)
    return np.sqrt((a * a).reshape(len(a), -1).sum(axis=1))


def error(got, expected, scale=None):
    """Error of each sample relative to its scale, which is the answer's own norm unless given."""
    return size(got - expected) / (size(expected) if scale is None else scale)


class Batch:
    """Triangles, what the student functions make of them, and the truth."""

    def __init__(self, f, seed, condition, bound):
        rng = np.random.default_rng(seed)
        self.X, self.x, self.condition = fast.triangles(rng, COUNT, condition)
        self.bound = bound(self.condition)
        self.mu, self.lam, self.h = fast.materials(rng, COUNT)
        self.stiff = 2 * self.mu + self.lam
        self.A, self.rest = fast.in_plane(self.X, self.x)
        self.area, self.N = self.rest.area.astype(float), self.rest.N.astype(float)
        self.corners = {f"X{k}": self.X[:, k] for k in range(3)}
        self.moved = {f"x{k}": self.x[:, k] for k in range(3)}
        self.dphi = muslin.evaluate(f.dphi_dX, **self.corners)
        self.F = muslin.evaluate(f.deformation_gradient, **self.moved, dphi_dX=self.dphi, N=self.N)
        self.U, self.s, self.V = muslin.evaluate(given.svd, F=self.F, N=self.N)
        self.p = muslin.evaluate(f.dpsi_ds, s=self.s, mu=self.mu, lam=self.lam)
        self.n = np.stack([jet.value for jet in fast.unit_normal(self.x)], axis=1)
        self.true_F = self.A @ self.rest.T.transpose(0, 2, 1) + self.n[:, :, None] * self.rest.N[:, None, :]
        self.P = muslin.evaluate(f.dpsi_dF, U=self.U, dpsi_ds=self.p, V=self.V)


@pytest.fixture(scope="module")
def f():
    return muslin.load(SOLUTION)


@pytest.fixture(scope="module")
def ordinary(f):
    """cond(D) <= 10: everything to 1e-12."""
    return Batch(f, 1, (0, 1), lambda condition: np.full(COUNT, 1e-12))


class Apart:
    """Deformation gradients whose three stretches differ pairwise by 1e-3 or more: psi'' exists in 3x3."""

    def __init__(self, f):
        rng = np.random.default_rng(12)
        gap = 10 ** rng.uniform(-3, 0, (COUNT, 2))
        near_one = 1 + 1.001 * gap[:, 0] * rng.choice([-1, 1], COUNT)
        pairs = np.stack([near_one, near_one + 1.001 * gap[:, 1] * rng.choice([-1, 1], COUNT)], axis=1)
        anywhere = rng.uniform(0.05, 3, (COUNT, 2))
        separate = ((pairs >= 0.05) & (np.abs(pairs - 1) > 1e-3)).all(axis=1)
        pairs = np.where(separate[:, None], pairs, anywhere)
        pairs[(np.abs(pairs - 1).min(axis=1) < 1e-3) | (np.abs(pairs[:, 0] - pairs[:, 1]) < 1e-3)] = 2, 0.05
        s = np.concatenate([pairs, np.ones((COUNT, 1))], axis=1)
        V = fast.rotations(rng, COUNT)
        self.F = (fast.rotations(rng, COUNT) * s[:, None, :]) @ V.transpose(0, 2, 1)
        self.N = V[:, :, 2]
        self.mu, self.lam, _ = fast.materials(rng, COUNT)
        self.stiff = 2 * self.mu + self.lam
        self.U, self.s, self.V = muslin.evaluate(given.svd, F=self.F, N=self.N)
        self.p = muslin.evaluate(f.dpsi_ds, s=self.s, mu=self.mu, lam=self.lam)
        self.P = muslin.evaluate(f.dpsi_dF, U=self.U, dpsi_ds=self.p, V=self.V)
        self.gap = np.abs(self.s - np.roll(self.s, 1, axis=1)).min(axis=1)
        self.psi = fast.energy_of_F(self.F, self.U, self.V, self.mu, self.lam)


@pytest.fixture(scope="module")
def apart(f):
    return Apart(f)


@pytest.fixture(scope="module")
def thin(f):
    """cond(D) up to 1e4: everything to 1e-15 cond^2, where that is more than 1e-12."""
    return Batch(f, 2, (0, 4), lambda condition: np.maximum(1e-12, 1e-15 * condition**2))


@pytest.fixture(scope="module", params=["ordinary", "thin"])
def batch(request):
    return request.getfixturevalue(request.param)


def holds(found, bound):
    """Every error is within its bound (a NaN is not)."""
    worst = int(np.argmax(np.nan_to_num(found / bound, nan=np.inf)))
    print(f"worst error {found[worst]:.1e}, bound {bound[worst]:.1e}")  # pytest -rA shows the margins
    assert (found <= bound).all(), f"sample {worst}: error {found[worst]:.2e}, bound {bound[worst]:.1e}"


# --- S1-S3: shape functions and the deformation gradient ---------------------------------------------------


def test_the_triangles_cover_what_they_should(ordinary, thin):
    s = ordinary.s[:, :2]
    assert ordinary.condition.max() <= 10
    assert 1e3 < thin.condition.max() <= 1.001e4
    assert s.min() < 0.06
    assert s.max() > 2.9
    assert (s[:, 0] == s[:, 1]).sum() > 50
    assert ((s[:, 0] != s[:, 1]) & (s[:, 0] - s[:, 1] < 1e-9)).sum() > 50
    assert (s == 1).any(axis=1).sum() > 50
    assert (s == 1).all(axis=1).any()
    assert (s < 1).all(axis=1).sum() > 1000


def test_shape_functions_are_barycentric_coordinates_of_the_nearest_point(f, batch):
    rng = np.random.default_rng(3)
    weights = rng.uniform(-1, 2, (COUNT, 3))
    weights /= np.where(np.abs(weights.sum(axis=1)) > 0.3, weights.sum(axis=1), 1)[:, None]
    off_plane = rng.uniform(-1, 1, COUNT) * batch.rest.length.astype(float)
    X = np.einsum("ei,eik->ek", weights, batch.X) + off_plane[:, None] * batch.N
    got = muslin.evaluate(f.phi, X=X, **batch.corners)
    V = batch.X.astype(fast.Real)
    m = np.cross(V[:, 1] - V[:, 0], V[:, 2] - V[:, 0])
    square = (m * m).sum(axis=1)
    nearest = X - ((X - V[:, 0]) * m).sum(axis=1)[:, None] / square[:, None] * m
    parts = [
        (m * np.cross(V[:, (i + 1) % 3] - nearest, V[:, (i + 2) % 3] - nearest)).sum(axis=1) / square
        for i in range(3)
    ]
    expected = np.stack(parts, axis=1)
    holds(error(got, expected, 1 + size(expected)), batch.bound)


def test_gradients_of_the_shape_functions_match_the_truth(batch):
    expected = np.einsum("eia,eka->eik", batch.rest.dphi, batch.rest.T)
    holds(error(batch.dphi, expected), batch.bound)


def test_a_point_is_the_weighted_sum_of_the_vertices(f, ordinary):
    phi = np.random.default_rng(4).uniform(-1, 1, (COUNT, 3))
    got = muslin.evaluate(f.interpolate, phi=phi, **ordinary.moved)
    expected = np.einsum("ei,eik->ek", phi.astype(fast.Real), ordinary.x)
    holds(error(got, expected, size(phi) * size(ordinary.x)), ordinary.bound)


def test_deformation_gradient_maps_the_plane_and_the_normal(batch):
    holds(error(batch.F, batch.true_F), batch.bound)
    holds(error(batch.F @ batch.rest.T, batch.A), batch.bound)


def test_deformation_gradient_matches_its_definition_for_given_inputs(f, ordinary):
    got = muslin.evaluate(f.deformation_gradient, **ordinary.moved, dphi_dX=ordinary.dphi, N=ordinary.N)
    x, dphi = ordinary.x.astype(fast.Real), ordinary.dphi
    expected = np.einsum("eik,eim->ekm", x, dphi) + ordinary.n[:, :, None] * ordinary.N[:, None, :]
    holds(error(got, expected, 1 + size(ordinary.x) * size(dphi)), ordinary.bound)


def test_derivative_of_the_normal_matches_the_truth(f, batch):
    jets = fast.unit_normal(batch.x)
    deformed = fast.flat(batch.x)
    cond = (deformed.length**2 / (2 * deformed.area)).astype(float)  # of the deformed triangle
    for i in range(3):
        got = muslin.evaluate(f.dn_dx, **batch.moved, i=i)
        expected = np.stack([jet.gradient[:, 3 * i : 3 * i + 3] for jet in jets], axis=1)
        holds(error(got, expected), np.maximum(1e-12, 1e-15 * cond**2))


# --- S4: mass and kinetic energy ---------------------------------------------------------------------------


def test_mass_is_the_integral_of_two_shape_functions(f, ordinary):
    rng = np.random.default_rng(5)
    rho = 10 ** rng.uniform(0, 3, COUNT)
    for i in range(3):
        for j in range(3):
            got = muslin.evaluate(f.mass_block, i=i, j=j, area=ordinary.area, rho=rho, h=ordinary.h)
            integral = fast.over_triangle(
                lambda phi, i=i, j=j: phi[i] * phi[j], ordinary.area.astype(fast.Real)
            )
            holds(error(got, ordinary.h * rho * integral), ordinary.bound)


def test_kinetic_energy_is_the_integral_of_half_rho_v_squared(f, ordinary):
    rng = np.random.default_rng(6)
    rho, v = 10 ** rng.uniform(0, 3, COUNT), rng.normal(size=(COUNT, 3, 3))
    corners = {f"v{k}": v[:, k] for k in range(3)}
    got = muslin.evaluate(f.kinetic_energy, **corners, area=ordinary.area, rho=rho, h=ordinary.h)

    def squared_speed(phi):
        return (sum(phi[k] * v[:, k].astype(fast.Real) for k in range(3)) ** 2).sum(axis=1)

    integral = fast.over_triangle(squared_speed, ordinary.area.astype(fast.Real))
    holds(error(got, ordinary.h * rho / 2 * integral), ordinary.bound)


# --- S5-S7: stretches, energy, stress, force ---------------------------------------------------------------


def test_right_cauchy_green_measures_squared_lengths(f, ordinary):
    got = muslin.evaluate(f.right_cauchy_green, F=ordinary.F)
    dX = fast.variables(np.zeros((COUNT, 3)))
    rows = [sum(ordinary.F[:, k, m] * dX[m] for m in range(3)) for k in range(3)]
    expected = fast.dot(rows, rows).hessian / 2
    holds(error(got, expected, size(ordinary.F) ** 2), ordinary.bound)


def test_strain_energy_and_its_derivatives_match_the_truth(f, ordinary):
    s, mu, lam = ordinary.s, ordinary.mu, ordinary.lam
    s0, s1, _ = fast.variables(s)
    psi = mu * ((s0 - 1) * (s0 - 1) + (s1 - 1) * (s1 - 1)) + lam / 2 * ((s0 + s1 - 2) * (s0 + s1 - 2))
    inputs = {"s": s, "mu": mu, "lam": lam}
    holds(error(muslin.evaluate(f.psi, **inputs), psi.value, ordinary.stiff), ordinary.bound)
    holds(error(muslin.evaluate(f.dpsi_ds, **inputs), psi.gradient, ordinary.stiff), ordinary.bound)
    holds(error(muslin.evaluate(f.d2psi_ds2, **inputs), psi.hessian, ordinary.stiff), ordinary.bound)


def test_energy_of_a_triangle_matches_the_truth(f, batch):
    got = muslin.evaluate(f.psi, s=batch.s, mu=batch.mu, lam=batch.lam)
    expected = fast.energy_of_A(batch.A, batch.mu, batch.lam).value
    holds(error(got, expected, batch.stiff + expected), batch.bound)


def test_stress_is_the_gradient_of_the_energy_in_the_deformation_gradient(batch):
    gradient = fast.energy_of_A(batch.A, batch.mu, batch.lam).gradient.reshape(-1, 3, 2)
    expected = gradient @ batch.rest.T.transpose(0, 2, 1)  # nothing along N: the normal stores no energy
    holds(error(batch.P, expected, batch.stiff), batch.bound)


def test_stress_is_the_gradient_of_the_energy_that_follows_the_normal(apart):
    expected = apart.psi.gradient.reshape(-1, 3, 3)
    holds(error(apart.P, expected, apart.stiff), np.full(COUNT, 1e-12))


def test_force_is_minus_the_gradient_of_the_potential_energy(f, batch):
    _, gradient, _ = fast.element(batch.X, batch.x, batch.mu, batch.lam, batch.h)
    altitude = (
        2 * batch.rest.area / batch.rest.length
    )  # 1/altitude is the size of a shape function's gradient
    scale = batch.h * batch.rest.area * batch.stiff / altitude
    for i in range(3):
        force = {"P": batch.P, "grad_phi": batch.dphi[:, i], "area": batch.area, "h": batch.h}
        got = muslin.evaluate(f.nodal_force, **force)
        holds(error(got, -gradient[:, 3 * i : 3 * i + 3], scale), batch.bound)


# --- S8: the two roads to the Hessian ----------------------------------------------------------------------


def test_singular_value_decomposition_is_exact_and_keeps_the_normal_last(batch):
    F = batch.true_F.astype(float)
    U, s, V = muslin.evaluate(given.svd, F=F, N=batch.N)
    holds(error(U @ (s[:, :, None] * V.transpose(0, 2, 1)), F), np.full(COUNT, 4e-15))
    for R in (U, V):
        holds(size(R.transpose(0, 2, 1) @ R - np.eye(3)), np.full(COUNT, 4e-15))
        holds(np.abs(np.linalg.det(R) - 1), np.full(COUNT, 4e-15))
    assert (V[:, :, 2] == batch.N).all()
    assert (s[:, 0] >= s[:, 1]).all()
    assert (s[:, 2] == 1).all()
    flattened = s[:, 0] / s[:, 1]
    holds(size(U[:, :, 2] - batch.n), 4e-15 * flattened)


def test_derivative_of_the_stress_follows_its_own_formula(f, ordinary):
    rng = np.random.default_rng(7)
    U, V = fast.rotations(rng, COUNT), fast.rotations(rng, COUNT)
    dU, dV, ds, p = (rng.normal(size=(COUNT, *shape)) for shape in ((3, 3), (3, 3), (3,), (3,)))
    H = rng.normal(size=(COUNT, 3, 3))
    H = H + H.transpose(0, 2, 1)
    got = muslin.evaluate(f.d2psi_dFij, U=U, V=V, dpsi_ds=p, d2psi_ds2=H, dU=dU, ds=ds, dV=dV)
    (t,) = fast.variables(np.zeros((COUNT, 1)))
    change = (H.astype(fast.Real) * ds[:, None, :]).sum(axis=2)
    expected = np.empty((COUNT, 3, 3), dtype=fast.Real)
    for i in range(3):
        for j in range(3):
            terms = (
                (U[:, i, k] + dU[:, i, k] * t) * (p[:, k] + change[:, k] * t) * (V[:, j, k] + dV[:, j, k] * t)
                for k in range(3)
            )
            expected[:, i, j] = sum(terms).gradient[:, 0]
    holds(error(got, expected), ordinary.bound)


def hessian_by_the_lecture(f, b):
    """psi'' (b, 9, 9), column ij from the given dsvd and the student's product rule."""
    H = muslin.evaluate(f.d2psi_ds2, s=b.s, mu=b.mu, lam=b.lam)
    columns = []
    for k in range(9):
        i, j = (np.full(len(b.s), index, dtype=np.int32) for index in divmod(k, 3))
        dU, ds, dV = muslin.evaluate(given.dsvd, U=b.U, s=b.s, V=b.V, i=i, j=j)
        column = muslin.evaluate(f.d2psi_dFij, U=b.U, V=b.V, dpsi_ds=b.p, d2psi_ds2=H, dU=dU, ds=ds, dV=dV)
        columns.append(column.reshape(-1, 9))
    return np.stack(columns, axis=2)


def test_hessian_by_the_lecture_matches_the_truth_where_all_stretches_differ(f, apart):
    assert 1e-3 < apart.gap.min() < 1.1e-3
    holds(error(hessian_by_the_lecture(f, apart), apart.psi.hessian), np.full(COUNT, 1e-9))


MODES = np.array(
    [
        [[0, 1], [1, 0], [0, 0]],  # flip
        [[0, -1], [1, 0], [0, 0]],  # twist
        [[0, 0], [0, 0], [2**0.5, 0]],  # out_0
        [[0, 0], [0, 0], [0, 2**0.5]],  # out_1
    ]
) / np.sqrt(fast.Real(2))


@pytest.mark.parametrize(("energy", "bound"), [("linearised", 1e-12), ("area", 1e-10)])
def test_eigensystem_is_the_curvature_of_the_energy_along_the_four_modes(f, ordinary, energy, bound):
    rng = np.random.default_rng(8)
    s = ordinary.s.copy()
    s[::5, 1] = s[::5, 0]
    s[1::5, 1] = s[1::5, 0] - 10 ** rng.uniform(
        -9, -1, len(s[1::5])
    )  # the gaps where the limit is taken or not
    s[:, 1] = np.maximum(s[:, 1], 0.05)
    s = np.stack([s[:, :2].max(axis=1), s[:, :2].min(axis=1), s[:, 2]], axis=1)
    mu, lam = ordinary.mu, ordinary.lam
    p, H = derivatives_in_s(s, mu, lam, energy)
    got = muslin.evaluate(f.eigensystem, s=s, dpsi_ds=p, d2psi_ds2=H)
    A = np.zeros((COUNT, 3, 2), dtype=fast.Real)
    A[:, 0, 0], A[:, 1, 1] = s[:, 0], s[:, 1]
    curvature = fast.energy_of_A(A, mu, lam, energy).hessian
    modes = MODES.reshape(4, 6)
    expected = np.stack([np.einsum("A,eAB,B->e", mode, curvature, mode) for mode in modes], axis=1)
    holds(error(got, expected, size(H)), np.full(COUNT, bound))


def derivatives_in_s(s, mu, lam, energy):
    """Gradient and Hessian of psi in the stretches, rounded to double."""
    s0, s1, _ = fast.variables(s)
    change = s0 + s1 - 2 if energy == "linearised" else s0 * s1 - 1
    psi = mu * ((s0 - 1) * (s0 - 1) + (s1 - 1) * (s1 - 1)) + lam / 2 * (change * change)
    return psi.gradient.astype(float), psi.hessian.astype(float)


# --- S9: collision -----------------------------------------------------------------------------------------


def test_contact_is_a_distance_below_the_radius_with_the_normal_pointing_out(f):
    rng = np.random.default_rng(9)
    c, r = rng.uniform(-3, 3, (COUNT, 3)), rng.uniform(0.01, 3, COUNT)
    x = c + rng.normal(size=(COUNT, 3)) * r[:, None]
    x[:100] = c[:100]
    hit, n = muslin.evaluate(f.sphere_contact, x=x, c=c, r=r)
    d = x.astype(fast.Real) - c
    distance = fast.norm(d)
    up = np.array([0, 1, 0], dtype=fast.Real)
    expected = np.where(distance[:, None] > 0, d / np.where(distance > 0, distance, 1)[:, None], up)
    assert (hit == (distance < r)).all()
    assert 1000 < hit.sum() < 9000
    holds(error(n, expected), np.full(COUNT, 1e-12))


def test_the_filter_removes_the_velocity_into_the_obstacle_and_nothing_else(f):
    rng = np.random.default_rng(10)
    v, n = rng.normal(size=(COUNT, 3)), rng.normal(size=(COUNT, 3))
    n /= size(n)[:, None]
    n[::10], v[::10, 2] = (0, 0, -1), 0  # exactly along the surface
    got = muslin.evaluate(f.filter_velocity, v=v, n=n)
    d = (v.astype(fast.Real) * n).sum(axis=1)
    into = d < 0
    holds(error(got[into], (v - d[:, None] * n)[into], size(v[into])), np.full(into.sum(), 1e-12))
    assert (got[~into] == v[~into]).all()
    assert ((got * n).sum(axis=1) > -4e-15).all()


# --- all of them -------------------------------------------------------------------------------------------


def test_the_same_inputs_give_the_same_bits_twenty_times(f, ordinary):
    from muslin.judging import reference

    for name in f.assignment.tasks:
        inputs, _ = reference.cases("cloth", name)
        first = as_bytes(muslin.evaluate(f[name], **inputs))
        assert all(as_bytes(muslin.evaluate(f[name], **inputs)) == first for _ in range(20)), name


def as_bytes(results):
    results = results if isinstance(results, tuple) else (results,)
    return [result.tobytes() for result in results]


# --- the truth itself --------------------------------------------------------------------------------------


def precise(values):
    """Numbers of mpmath as longdouble."""
    nstr = tr.precise().nstr
    array = np.array(values, dtype=object)
    return np.array([fast.Real(nstr(value, 25)) for value in array.ravel()]).reshape(array.shape)


@pytest.mark.parametrize("energy", ["linearised", "area"])
def test_both_truths_agree_on_the_potential_energy_of_a_triangle(energy):
    b = 24
    rng = np.random.default_rng(11)
    X, x, _ = fast.triangles(rng, b)
    mu, lam, h = fast.materials(rng, b)
    V, gradient, hessian = fast.element(X, x, mu, lam, h, energy)
    rest = fast.flat(X)
    for k in range(b):
        vertices, *material = (tr.exact(values[k]) for values in (X, mu, lam, h))

        def potential(q, vertices=vertices, material=material):
            return known("cloth", "potential_energy")(vertices, [q[:3], q[3:6], q[6:]], *material, energy)

        q = tr.exact(x[k].ravel())
        scale = h[k] * rest.area[k] * (2 * mu[k] + lam[k])
        assert abs(V[k] - precise(potential(q))) < 1e-17 * scale
        assert size([gradient[k] - precise(tr.gradient(potential, q))]) < 1e-15 * scale / rest.length[k]
        expected = precise(tr.hessian(potential, q))
        assert size([hessian[k] - expected]) < 1e-15 * size([expected])


def test_both_truths_agree_on_the_energy_that_follows_the_normal(apart):
    hardest = np.argsort(apart.gap)
    for k in (*hardest[:6], *hardest[::1500]):
        s, mu, lam = (tr.exact(values[k]) for values in (apart.s, apart.mu, apart.lam))

        def density(F, s=s, mu=mu, lam=lam):
            return known("cloth", "psi_of_F")([F[:3], F[3:6], F[6:]], s, mu, lam)

        F = tr.exact(apart.F[k].ravel())
        assert size([apart.psi.gradient[k] - precise(tr.gradient(density, F))]) < 1e-15 * apart.stiff[k]
        expected = precise(tr.hessian(density, F))
        assert size([apart.psi.hessian[k] - expected]) < 1e-13 * size([expected])
