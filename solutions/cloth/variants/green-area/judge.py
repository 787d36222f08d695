def _both(s: Vector, mu: Any, lam: Any, strains: Any, change: Any) -> Any:
    return mu * sum(strains(t) ** 2 for t in s[:2]) + lam / 2 * change(s) ** 2


def _green(t: Any) -> Any:
    return (t * t - 1) / 2


def _area(s: Vector) -> Any:
    return s[0] * s[1] - 1


WRONG = (
    (
        "lengths by s - 1",
        "The strain in the mu term is s - 1: that is the area energy of the lecture.",
        "Green's strain counts squares of lengths: (s^2 - 1)/2.",
        lambda s, mu, lam: _both(s, mu, lam, lambda t: t - 1, _area),
    ),
    (
        "strain doubled",
        "The strain is s^2 - 1: its half is missing.",
        "For a small change of length the strain must be that change: what is s^2 - 1 then?",
        lambda s, mu, lam: _both(s, mu, lam, lambda t: t * t - 1, _area),
    ),
    (
        "third stretch",
        "The third stretch takes part.",
        "Only the two stretches in the plane store energy; do not count on the third being 1.",
        lambda s, mu, lam: mu * sum(_green(t) ** 2 for t in s) + lam / 2 * (s[0] * s[1] * s[2] - 1) ** 2,
    ),
    (
        "sum of the strains",
        "The lam term holds the sum of the strains: that is St. Venant-Kirchhoff's energy.",
        "Here lam weighs the change of area, s_0 s_1 - 1.",
        lambda s, mu, lam: _both(s, mu, lam, _green, lambda t: _green(t[0]) + _green(t[1])),
    ),
    (
        "linearised area",
        "The area is linearised: s_0 + s_1 - 2.",
        "Take the area itself: a product.",
        lambda s, mu, lam: _both(s, mu, lam, _green, lambda t: t[0] + t[1] - 2),
    ),
    (
        "doubled:lam",
        "The lam term is twice too large.",
        "Look at the number in front of lam in the formula.",
        lambda s, mu, lam: _both(s, mu, 2 * lam, _green, _area),
    ),
    (
        "halved:mu",
        "The mu term is half of the right one.",
        "Look at the number in front of mu in the formula.",
        lambda s, mu, lam: _both(s, mu / 2, lam, _green, _area),
    ),
)
