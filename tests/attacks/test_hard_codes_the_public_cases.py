"""Attack 18: answers the public cases from a table.

Defence: hidden cases drawn from the submission's own bytes; the seed stands in the record.
"""

from attacking import TARGET, honest, write

import muslin
from muslin.judging import reference

ANSWERS = """
from muslin.tasks import batch
import numpy as np
answers = {ANSWERS}
real = batch.evaluate
def looked_up(function, **arrays):
    got = np.array(real(function, **arrays))
    if "v" in arrays:
        for k, v in enumerate(arrays["v"]):
            got[k] = answers.get(tuple(v.tolist()), got[k])
        return got
    return real(function, **arrays)
batch.evaluate = looked_up
"""


def test_a_table_of_public_answers_earns_nothing(attack):
    inputs, (expected,) = reference.cases("cloth", "filter_velocity")
    table = {tuple(v.tolist()): e.tolist() for v, e in zip(inputs["v"], expected, strict=True)}
    hostile = ANSWERS.replace("{ANSWERS}", repr(table)) + honest().replace("v - d * n", "v")
    record = attack({TARGET: hostile})
    checks = {check.layer: check.status for check in record["filter_velocity"].checks}
    assert (checks["public"], checks["hidden"]) == ("passed", "failed")
    assert record["filter_velocity"].score == 0


def test_cases_are_drawn_from_the_submission(tmp_path):
    folder = write(tmp_path / "s", {TARGET: "# nothing"})
    first = muslin.grade(folder).seed
    (folder / TARGET).write_text("# nothing at all")
    assert muslin.grade(folder).seed != first
