"""What students may know of the descent: what must hold for every input."""

import numpy as np

from muslin.judging import Property
from muslin.judging.relations import between


def _begun(rng):
    A = between(rng, -1, 1, 5, 4, 4)
    vectors = {name: between(rng, -1, 1, 5, 4) for name in ("x", "b")}
    return {**vectors, "A": A @ np.swapaxes(A, 1, 2), "step": between(rng, 0.1, 1, 5)}


properties_descend = (
    Property(
        "the way is what x changes by",
        "How far it is must be the distance between the old x and the new.",
        _begun,
        lambda a, out: np.abs(np.linalg.norm(out[0] - a["x"], axis=1) - out[1]),
    ),
)
