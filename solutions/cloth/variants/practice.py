def _exchanged(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    """Change: s_0 and s_1 trade places."""
    return {"s": a["s"][:, [1, 0, 2]]}


def _other_normal(rng: Rng, a: np.ndarrays) -> np.ndarrays:
    """Change: another third stretch."""
    return {"s": a["s"] * np.array([1, 1, 0]) + between(rng, 0.4, 1.8, len(a["s"]), 1) * np.array([0, 0, 1])}


def _relaxed(rng: Rng) -> np.ndarrays:
    return {**material(rng, 8), "s": np.ones((8, 3))}


def _materials_add(terms: Terms) -> Property:
    return Property(
        "linear in mu and lam",
        "Two materials together, their Lamé parameters mu and lam added, must give the sum of both.",
        summed(states, "mu", "lam"),
        follows(terms, lambda one, other: one + other, runs=3),
    )


def _third_stretch(terms: Terms) -> Property:
    return Property(
        "the normal's stretch does not count",
        "Only the two stretches in the plane store energy: the third, s_2, must not matter.",
        again(states, _other_normal),
        follows(terms, lambda result: result),
        cause="third stretch",
    )


properties_psi = (
    Property(
        "no energy at rest",
        "At s = (1, 1, 1) the energy must be zero.",
        _relaxed,
        vanishes(terms_psi, lambda a, psi: psi),
    ),
    Property(
        "never negative",
        "Deforming the cloth in any way costs energy: psi must never be negative.",
        lambda rng: states(rng, 24),
        vanishes(terms_psi, lambda a, psi: np.minimum(psi, 0)),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must not change the energy.",
        again(states, _exchanged),
        follows(terms_psi, lambda psi: psi),
    ),
    _third_stretch(terms_psi),
    _materials_add(terms_psi),
)


properties_dpsi_ds = (
    Property(
        "no stress at rest",
        "At s = (1, 1, 1) the energy is least, so its gradient must be zero.",
        _relaxed,
        vanishes(terms_dpsi_ds, lambda a, p: p),
    ),
    Property(
        "third entry zero",
        "psi does not depend on s_2, so the third entry must be zero.",
        states,
        vanishes(terms_dpsi_ds, lambda a, p: p[:, 2]),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two entries.",
        again(states, _exchanged),
        follows(terms_dpsi_ds, lambda p: p[:, [1, 0, 2]]),
    ),
    _third_stretch(terms_dpsi_ds),
    _materials_add(terms_dpsi_ds),
)


properties_d2psi_ds2 = (
    Property(
        "symmetric",
        "Second derivatives do not care about their order: the matrix must be symmetric.",
        states,
        vanishes(None, lambda a, H: H - transposed(H)),
    ),
    Property(
        "third row and column zero",
        "psi does not depend on s_2, so the third row and column must be zero.",
        states,
        vanishes(None, lambda a, H: np.concatenate([H[:, 2], H[:, :, 2]], axis=1)),
    ),
    Property(
        "small strains",
        "At rest the Hessian must be that of the linearised energy: 2 mu + lam on the diagonal, lam off it.",
        _relaxed,
        vanishes(None, lambda a, H: H[:, :2, :2] - _linearised(a)),
    ),
    Property(
        "no direction is special",
        "Exchanging s_0 and s_1 must exchange the first two rows and columns.",
        again(states, _exchanged),
        follows(None, lambda H: H[:, [1, 0, 2]][:, :, [1, 0, 2]]),
    ),
    _materials_add(None),
)


def _linearised(a: Given) -> np.ndarray:
    mu, lam = a["mu"][:, None, None], a["lam"][:, None, None]
    return 2 * mu * np.eye(2) + lam * np.ones((2, 2))
