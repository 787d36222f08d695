"""Attack 15: NaN and infinity, everywhere or in the hidden cases only, and numbers that overflow in a difference.

Defence: finiteness is checked before any value, and an error must be at most the tolerance.
"""

import pytest
from attacking import FILES, TASKS, honest, public_sizes

HOSTILE = """
import numpy as np
from muslin.tasks import batch
real = batch.evaluate
def poisoned(function, **arrays):
    got = real(function, **arrays)
    got = got if isinstance(got, tuple) else (got,)
    for array in got:
        if array.dtype.kind == "f" and len(array) not in SPARED:
            array[...] = VALUE
    return got
batch.evaluate = poisoned
"""


VALUES = ("np.nan", "np.inf", "-np.inf", "1.7e308", "5e-324", "-0.0", "1e-308")


@pytest.mark.parametrize("spared", [[], public_sizes()], ids=["everywhere", "in hidden cases"])
def test_no_number_beats_the_comparison(attack, spared):
    files = {}
    for file, value in zip(FILES, VALUES, strict=True):
        files[file] = HOSTILE.replace("VALUE", value).replace("SPARED", repr(spared)) + honest(file)
    record = attack(files, spoils=tuple(TASKS))
    assert record.score == 0
    assert {result.status for result in record} == {"failed"}
