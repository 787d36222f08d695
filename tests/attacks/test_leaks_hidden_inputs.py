"""Attack 12: leaks the hidden inputs through exceptions, prints, results, and what is kept for the next grading.

Defence: of hidden cases nothing but a category is told; what is compiled is kept before any hidden input goes
out.
"""

import pytest
from attacking import SPOILED, TARGET, first_hidden, honest, readable

HOSTILE = """
import json, os, numpy as np
from muslin.tasks import batch
real = batch.evaluate

def leaking(function, **arrays):
    private = next(iter(arrays.values())).flat[0] in HIDDEN
    numbers = [float(v) for a in arrays.values() for v in np.ravel(a)]
    text = "LEAK " + json.dumps(numbers)
    print(text)
    os.write(2, text.encode())
    for folder in (".", "kernels", "/tmp", "/dev/shm", "/submission"):
        try:
            os.makedirs(folder, exist_ok=True)
            if private:
                open(folder + "/leak.txt", "a").write(text)
        except OSError:
            pass
    if RAISES and private:
        raise ValueError(text)
    return real(function, **arrays)

batch.evaluate = leaking
for folder in (".", "kernels", "/tmp", "/dev/shm", "/submission"):
    try:
        for name in os.listdir(folder):
            if name.startswith("leak."):
                print("KEPT", open(folder + "/" + name).read())
    except OSError:
        pass
"""


@pytest.mark.parametrize("raises", [False, True])
def test_hidden_inputs_are_not_told(attack, raises):
    hidden = [first_hidden(task) for task in SPOILED]
    hostile = HOSTILE.replace("RAISES", repr(raises)).replace("HIDDEN", repr(hidden))
    record = attack({TARGET: hostile + honest()})
    again = attack({TARGET: hostile + honest()})  # with what the first left in the cache
    assert "LEAK" in record["sphere_contact"].output  # the public cases, which are no secret
    assert "KEPT" not in readable(again)
    if raises:
        assert "hidden inputs" in readable(record)
        assert record["sphere_contact"].score == 0
