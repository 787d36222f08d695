"""One attack of each defence on the solids assignment: the walls know no assignment, and that is held against them.

The texts are those of the attacks on cloth, where each is tried in all its forms.
"""

import numpy as np
import pytest
from attacking import LEVEL, SEED, _stage, honest, write
from test_changes_its_inputs import HOSTILE as CHANGES
from test_leaks_hidden_inputs import HOSTILE as LEAKS
from test_no_expected_value_in_a_worker import descendants, found_in, uncommon
from test_patches_the_comparison import HOSTILE as AGREES
from test_plain_python_is_judged_behind_the_same_walls import FILE, TASK, newton
from test_returns_nan_and_infinity import HOSTILE as POISONS
from test_returns_numbers_that_lie import HOSTILE as LIES
from test_returns_shapes_that_broadcast import HOSTILE as RESHAPES
from test_returns_zeros import ZEROS

from muslin import tasks
from muslin.grading import sandbox
from muslin.judging import reference

TABLE = tasks.assignment("solids")
#: Files that are right but for what is done to their answers, or to who asks for them.
ANSWERS = {
    "shape_functions.py": ZEROS.replace("FACTOR", "(1 + 1e-6)"),
    "deformation_gradient.py": POISONS.replace("VALUE", "np.nan").replace("SPARED", "[]"),
    "kinetic_energy.py": LIES,
    "neo_hookean.py": RESHAPES.replace("WHAT", "np.zeros((1, 3, 3))"),
    "forces.py": AGREES
    + "\nfrom muslin.tasks import batch\nbatch.evaluate = lambda function, **arrays: np.zeros(3)\n",
    "newton.py": "import os\nos._exit(0)\n",
}
MEANS = {
    "shape_functions.py": CHANGES.replace('arrays["v"] if "v" in arrays else', "1 if 0 else"),
    "deformation_gradient.py": "while True: pass\n",
    "neo_hookean.py": "kept = []\nwhile True: kept.append(bytearray(1 << 28))\n",
    "forces.py": LEAKS.replace("RAISES", "True").replace("HIDDEN", "[0.0]")
    + "import taichi as ti\nti.init()\n",
    "newton.py": "import os, time\nif not os.fork(): os.setsid(); time.sleep(100)\n",
}


@pytest.mark.parametrize("files", [ANSWERS, MEANS], ids=["answers", "means"])
def test_no_task_of_an_attacking_file_is_taken_for_right(attack, files):
    hostile = {name: text + honest(name, "solids") for name, text in files.items()}
    spoiled = tuple(name for name, task in TABLE.tasks.items() if task.file in files)
    record = attack(hostile, spoils=spoiled, assignment="solids", deadline=4.0)
    for name in spoiled:
        leaves_its_answers = files is MEANS and TABLE.tasks[name].file == "newton.py"
        assert record[name].score == 0 or leaves_its_answers, name
    assert record.score <= (TABLE.tasks["newtons_method"].points if files is MEANS else 0) + sum(
        TABLE.tasks[name].points for name in TABLE.tasks if name not in spoiled
    )


def test_where_an_objective_is_least_is_not_in_a_workers_memory(attack, tmp_path, monkeypatch):
    """The student's code knows the public answers, so that hidden cases are asked, and computes nothing."""
    inputs, (known,) = reference.cases("solids", TASK)
    answers = {tuple(x.tolist()): m.tolist() for x, m in zip(inputs["x"], known, strict=True)}
    code = newton("return np.array(answers.get(tuple(x.tolist()), gradient(x)))", f"answers = {answers!r}\n")
    stage = _stage(TABLE, TASK, SEED)
    seen = uncommon([stage.inputs[value.name] for value in TABLE.tasks[TASK].seen])
    secret = np.setdiff1d(uncommon([*stage.expected, stage.inputs["A"], stage.inputs["w"]]), seen)
    assert len(secret) > 200
    found, searched = set(), 0
    ask = sandbox.Worker.ask

    def watched(self, request, arrays, *rest):
        nonlocal searched
        answer = ask(self, request, arrays, *rest)
        if request.get("task") == TASK and len(arrays["x"]) == len(stage.inputs["x"]):
            for pid in descendants(attack.token):
                try:
                    found.update(found_in(pid, np.concatenate([seen, secret])))
                except PermissionError:
                    pytest.skip("the memory of workers may not be read here")
                searched += 1
        return answer

    monkeypatch.setattr(sandbox.Worker, "ask", watched)
    record = attack.grade(write(tmp_path / "s", {FILE: code}), level=LEVEL, fresh=True, assignment="solids")
    assert record.score == 0
    assert searched >= 2
    assert len(found.intersection(seen.tolist())) > 20, "the search finds nothing at all"
    assert not found.intersection(secret.tolist())
