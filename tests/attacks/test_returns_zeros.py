"""Attack 16: zeros pass wherever an absolute tolerance dwarfs the scale of the answer.

Defence: errors are relative to the size of the answer or of its terms. Zeros, and a thousandth of a millionth
more than right, fail for every task.
"""

import pytest
from attacking import FILES, TASKS, honest

ZEROS = """
import numpy as np
from muslin.tasks import batch
real = batch.evaluate
def scaled(function, **arrays):
    got = real(function, **arrays)
    return tuple(g * FACTOR if g.dtype.kind == "f" else g for g in (got if isinstance(got, tuple) else (got,)))
batch.evaluate = scaled
"""


@pytest.mark.parametrize("factor", ["0.0", "(1 + 1e-6)"])
def test_no_task_takes_zeros(attack, factor):
    files = {name: ZEROS.replace("FACTOR", factor) + honest(name) for name in FILES}
    record = attack(files, spoils=tuple(TASKS))
    assert record.score == 0
