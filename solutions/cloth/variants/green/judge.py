def _green(s: Vector, count: int = 2, times: Any = 1) -> Vector:
    return [times * (t * t - 1) / 2 for t in s[:count]]


def _summed(strains: Vector, mu: Any, lam: Any) -> Any:
    return mu * sum(e * e for e in strains) + lam / 2 * sum(strains) ** 2


WRONG = (
    (
        "linearised",
        "The strain is s - 1: that is the linearised energy.",
        "Green's strain counts squares of lengths: (s^2 - 1)/2.",
        lambda s, mu, lam: _summed([t - 1 for t in s[:2]], mu, lam),
    ),
    (
        "strain doubled",
        "The strain is s^2 - 1: its half is missing.",
        "For a small change of length the strain must be that change: what is s^2 - 1 then?",
        lambda s, mu, lam: _summed(_green(s, times=2), mu, lam),
    ),
    (
        "third stretch",
        "The sum runs over three stretches.",
        "Only the two stretches in the plane store energy; do not count on the third being 1.",
        lambda s, mu, lam: _summed(_green(s, 3), mu, lam),
    ),
    (
        "area",
        "The lam term holds the change of area, the product of the stretches.",
        "Here lam weighs the sum of the two strains.",
        lambda s, mu, lam: _summed(_green(s), mu, 0) + lam / 2 * (s[0] * s[1] - 1) ** 2,
    ),
    (
        "each strain alone",
        "The lam term squares each strain alone.",
        "Add both strains first, then square.",
        lambda s, mu, lam: _summed(_green(s), mu + lam / 2, 0),
    ),
    (
        "doubled:lam",
        "The lam term is twice too large.",
        "Look at the number in front of lam in the formula.",
        lambda s, mu, lam: _summed(_green(s), mu, 2 * lam),
    ),
    (
        "halved:mu",
        "The mu term is half of the right one.",
        "Look at the number in front of mu in the formula.",
        lambda s, mu, lam: _summed(_green(s), mu / 2, lam),
    ),
)
