"""Attack 14: scalars, (n, 1), empty, transposed and 0-d results that broadcast against anything.

Defence: number, shape and type of the results are compared first, exactly.
"""

from attacking import FILES, TASKS, honest

HOSTILE = """
import numpy as np
from muslin.tasks import batch
batch.evaluate = lambda function, **arrays: WHAT
"""
SHAPES = {
    "0-d": "np.float64(0.0) * np.ones(())",
    "one row": "np.zeros((1, 3))",
    "a column": "np.zeros((len(next(iter(arrays.values()))), 1))",
    "empty": "np.zeros((0, 3))",
    "nothing": "()",
    "many": "tuple(np.zeros(3) for _ in range(2000))",
    "integers": "np.zeros((len(next(iter(arrays.values()))), 3), dtype=np.int32)",
}


def test_shape_comes_first(attack):
    files = {f: HOSTILE.replace("WHAT", w) + honest(f) for f, w in zip(FILES, SHAPES.values(), strict=True)}
    record = attack(files, spoils=tuple(TASKS))
    assert record.score == 0
    for result in record:
        assert (result.checks[0].layer, result.checks[0].status) == ("form", "failed"), result.name
