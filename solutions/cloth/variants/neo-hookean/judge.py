def _neo(s: Vector, mu: Any, k: Any, change: Any) -> Any:
    return mu / 2 * (s[0] - s[1]) ** 2 + k / 2 * change**2


WRONG = (
    (
        "shape missing",
        "The term with the difference of the stretches is missing.",
        "Without it a cloth could be pulled long and narrow for nothing.",
        lambda s, mu, lam: _neo(s, 0 * mu, lam + mu, s[0] * s[1] - 1),
    ),
    (
        "area missing",
        "The term with the change of area is missing.",
        "Without it a cloth could be made larger for nothing.",
        lambda s, mu, lam: _neo(s, mu, 0 * mu, 0 * mu),
    ),
    (
        "lam alone",
        "The change of area is weighed with lam alone, where lam + mu belongs.",
        "Compare the two terms for small strains with the linearised energy.",
        lambda s, mu, lam: _neo(s, mu, lam, s[0] * s[1] - 1),
    ),
    (
        "doubled:mu",
        "The term with the difference of the stretches is twice too large.",
        "Look at the number in front of mu in the formula.",
        lambda s, mu, lam: _neo(s, 2 * mu, lam + mu, s[0] * s[1] - 1),
    ),
    (
        "doubled:lam",
        "The term with the area is twice too large.",
        "Look at the number in front of lam + mu in the formula.",
        lambda s, mu, lam: _neo(s, mu, 2 * (lam + mu), s[0] * s[1] - 1),
    ),
    (
        "third stretch",
        "The third stretch takes part.",
        "Only the two stretches in the plane store energy; do not count on the third being 1.",
        lambda s, mu, lam: _neo(s, mu, lam + mu, s[0] * s[1] * s[2] - 1),
    ),
    (
        "linearised area",
        "The area is linearised: s_0 + s_1 - 2.",
        "Take the area itself: a product.",
        lambda s, mu, lam: _neo(s, mu, lam + mu, s[0] + s[1] - 2),
    ),
    (
        "area energy",
        "This is the area energy, the handout's example.",
        "Here mu weighs the difference of the stretches, not how far each is from 1.",
        lambda s, mu, lam: mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] * s[1] - 1) ** 2,
    ),
    (
        "squares apart",
        "The difference of the squared stretches stands where the square of their difference belongs.",
        "Subtract first, then square.",
        lambda s, mu, lam: mu / 2 * (s[0] ** 2 - s[1] ** 2) + (lam + mu) / 2 * (s[0] * s[1] - 1) ** 2,
    ),
)
