"""All attacks that a task in plain Python opens: the student's own code is called for every case, and given functions.

What those functions are built from holds the answer: of `newtons_method` the place where the objective is least.
Defence: they are answered by the grader, and what comes back from the worker is raw arrays, as of any task.
"""

import re

import pytest
from attacking import first_hidden, honest, needs, readable, write

from muslin import tasks
from muslin.judging import reference

FILE, TASK = "newton.py", "newtons_method"
HEAD = "def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):\n"


def newton(body: str, above: str = "") -> str:
    """A file whose function has this body, and returns x at its end."""
    lines = [*body.strip("\n").splitlines(), "return x"]
    return "import numpy as np\n" + above + HEAD + "".join(f"    {line}\n" for line in lines)


#: Takes whatever looks like the answer: no longer than x, and where the gradient is zero.
SEEKER = """
import gc, sys, types
cases = 0

def kept(thing, depth=0):
    if isinstance(thing, np.ndarray):
        yield thing
    elif depth < 3:
        inside = []
        if isinstance(thing, dict): inside = list(thing.values())
        elif isinstance(thing, (list, tuple)): inside = list(thing)
        elif isinstance(thing, types.FunctionType):
            inside = [cell.cell_contents for cell in thing.__closure__ or ()] + [thing.__defaults__]
        elif isinstance(thing, types.MethodType): inside = [thing.__self__, thing.__func__]
        for one in inside:
            yield from kept(one, depth + 1)

def candidates(*functions):
    for function in functions:
        yield from kept(function)
    frame = sys._getframe()
    while frame:
        yield from kept(dict(frame.f_locals))
        frame = frame.f_back
    for thing in gc.get_objects():
        if type(thing) in (dict, list, tuple):
            for one in gc.get_referents(thing):
                if isinstance(one, np.ndarray): yield one
"""
SEEK = """
global cases
begin, looked, cases = np.array(x), 0, cases + 1
if cases > 4: return begin
for found in candidates(objective, gradient, hessian, solve):
    if found.dtype == np.float64 and found.shape[-1:] == (4,) and 1 <= found.ndim <= 2:
        for row in found.reshape(-1, 4)[:8]:
            looked += 1
            if (row == begin).all(): continue
            if np.linalg.norm(gradient(row)) <= tolerance:
                print("FOUND IT")
                return np.array(row)
print("LOOKED AT", looked > 0)
return begin
"""


def test_the_answer_is_nowhere_in_a_worker(attack, level):
    record = attack(
        {FILE: newton(SEEK, SEEKER)}, spoils=(TASK,), level=level, assignment="solids", deadline=60
    )
    assert "LOOKED AT True" in record[TASK].output
    assert "FOUND IT" not in record[TASK].output
    assert record[TASK].score == 0


def test_the_same_search_finds_it_where_nothing_is_kept_apart(tmp_path):
    import muslin

    written = {FILE: newton(SEEK, SEEKER)}
    functions = muslin.load(write(tmp_path / "s", written), "solids")
    inputs, (expected,) = reference.cases("solids", TASK)
    got = muslin.evaluate(functions.newtons_method, **{k: a[:4] for k, a in inputs.items()})
    assert (got == expected[:4]).all(axis=1).sum() >= 3


#: What a function answers: {name: (above it, its body)}. None of it is where the objective is least.
LIES = {
    "a subclass that agrees with all": (
        """
class Liar(np.ndarray):
    def __eq__(self, other): return np.ones(np.shape(other), bool)
    def __sub__(self, other): return np.zeros(np.shape(other))
    __rsub__ = __sub__
    def __array_ufunc__(self, *args, **kwargs): return np.zeros(())
    def __array_function__(self, *args, **kwargs): return True
""",
        "return np.array(x).view(Liar)",
    ),
    "an object that is an array when asked": (
        """
class Late:
    def __array__(self, dtype=None, copy=None):
        np.asarray = np.array = lambda *args, **kwargs: 1 / 0
        return np.zeros(4)
    def __eq__(self, other): return True
""",
        "return Late()",
    ),
    "a comparison that always agrees": (
        """
import builtins, math, operator
always = lambda *args, **kwargs: True
np.allclose = np.array_equal = np.isclose = math.isclose = operator.eq = always
np.linalg.norm = lambda *args, **kwargs: 0.0
import scipy.linalg, scipy.optimize
scipy.linalg.norm = np.linalg.norm
import muslin.tasks.comparing as comparing
for name in list(vars(comparing)):
    if callable(getattr(comparing, name)): setattr(comparing, name, always)
""",
        "return np.array(x)",
    ),
    "whatever is evaluated": (
        """
from muslin.tasks import plain
plain.evaluate = lambda function, task, arrays, *rest: np.zeros_like(arrays["x"])
""",
        "return np.array(x)",
    ),
    "more than was asked": (
        """
from muslin.tasks import plain
plain.evaluate = lambda function, task, arrays, *rest: (np.zeros((10, *arrays["x"].shape)), np.zeros(3))
""",
        "return np.array(x)",
    ),
    "its input, moved": ("", "x *= 0\nreturn x"),
    "itself": ("", "a = np.empty(4, object); a[:] = [a] * 4\nreturn a"),
}


@pytest.mark.parametrize("lie", LIES)
def test_no_answer_is_taken_for_right_that_is_not(attack, lie):
    above, body = LIES[lie]
    record = attack({FILE: newton(body, above)}, spoils=(TASK,), instead_of={}, assignment="solids")
    assert record[TASK].score == 0
    assert record[TASK].status in ("failed", "error")


#: Ways to leave, never to end, or to take all there is.
ENDS = {
    "exit": ("import os\nos._exit(0)", "ended the process"),
    "a loop without end": ("while True: pass", "was stopped"),
    "memory": ("kept = []\nwhile True: kept.append(np.ones(1 << 24))", "MemoryError|killed|was stopped"),
    "recursion": ("return newtons_method(x, objective, gradient, hessian, solve, 0.0, 0)", "without end"),
}


@pytest.mark.parametrize("way", ENDS)
def test_who_does_not_answer_has_failed(attack, way):
    body, told = ENDS[way]
    record = attack({FILE: newton(body)}, spoils=(TASK,), instead_of={}, assignment="solids", deadline=2.0)
    assert record[TASK].status == "error"
    assert re.search(told, record[TASK].message)


#: What a worker may ask the grader, and should not.
CALLS = {
    "a function that is none": 'wire.send(channel, {"id": ID, "call": "__init__", "case": 0}, {})',
    "a case that is none": 'wire.send(channel, {"id": ID, "call": "objective", "case": 10**6}, {"0": x})',
    "millions of numbers": (
        'wire.send(channel, {"id": ID, "call": "solve", "case": 0}, {"0": np.ones((1500, 1500)), "1": np.ones(1500)})'
    ),
    "hundreds of arguments": (
        'wire.send(channel, {"id": ID, "call": "objective", "case": 0}, {str(k): x for k in range(500)})'
    ),
}
ASKING = """
import gc, socket
from muslin.grading import wire

def asked(function):
    cells = dict(zip(function.__code__.co_freevars, function.__closure__))
    return cells["channel"].cell_contents, cells["question"].cell_contents
"""


@pytest.mark.parametrize("what", CALLS)
def test_who_asks_the_grader_for_something_else_is_no_longer_heard(attack, what):
    body = f"channel, ID = asked(objective)\n{CALLS[what]}\nwire.receive(channel)\nreturn x"
    record = attack({FILE: newton(body, ASKING)}, spoils=(TASK,), instead_of={}, assignment="solids")
    assert record[TASK].status == "error"
    assert "something else than the arrays" in record[TASK].message


def test_a_flood_of_questions_costs_the_one_who_asks(attack):
    """Thousands of questions in one write cost a worker next to nothing: the grader's own time counts, too."""
    body = """
channel, ID = asked(objective)
import json
head = json.dumps({"id": ID, "call": "hessian", "case": 0, "arrays": [["0", "<f8", [4]]]}).encode()
flood = (wire._LENGTHS.pack(len(head) + 32, len(head)) + head + np.ones(4).tobytes()) * 500
while True:
    channel.sendall(flood)
    for _ in range(500): wire.receive(channel)
"""
    record = attack(
        {FILE: newton(body, ASKING)}, spoils=(TASK,), instead_of={}, assignment="solids", deadline=2.0
    )
    assert "was stopped" in record[TASK].message


def test_answers_that_raise_belong_to_who_asked(attack):
    body = """
try:
    objective(np.ones((3, 3)))
except ValueError as error:
    print("TOLD", error)
objective(np.ones((3, 3)))
return x
"""
    record = attack({FILE: newton(body)}, spoils=(TASK,), instead_of={}, assignment="solids")
    assert "TOLD" in record[TASK].output
    assert "raises ValueError" in record[TASK].message


def test_a_table_of_public_answers_earns_nothing(attack):
    inputs, (expected,) = reference.cases("solids", TASK)
    table = {tuple(x.tolist()): m.tolist() for x, m in zip(inputs["x"], expected, strict=True)}
    hostile = newton("return np.array(answers.get(tuple(x.tolist()), x))", f"answers = {table!r}\n")
    record = attack({FILE: hostile}, instead_of={}, spoils=(TASK,), assignment="solids")
    assert record[TASK].score == 0
    assert {c.layer: c.status for c in record[TASK].checks}["public"] == "passed"


@pytest.mark.parametrize("raises", [False, True])
def test_hidden_inputs_are_not_told(attack, raises):
    body = f"""
private = private or float(x[0]) == {first_hidden(TASK, "solids")!r}
text = "LEAK " + repr([x.tolist(), tolerance, gradient(x).tolist(), hessian(x).tolist()])
print(text)
if private and {raises}: raise ValueError(text)
return right(x, objective, gradient, hessian, solve, tolerance, most_steps)
"""
    above = honest(FILE, "solids") + "\nright, private = newtons_method, False\n"
    record = attack({FILE: newton("global private\n" + body, above)}, spoils=(TASK,), assignment="solids")
    assert "LEAK" in record[TASK].output  # the public cases, which are no secret
    if raises:
        assert "hidden inputs" in readable(record)
        assert record[TASK].score == 0


def test_nothing_of_muslin_minimises_for_a_student(attack, level):
    body = """
for name in ("muslin.simulation.newton", "muslin.simulation.by_student", "muslin.judging.judge", "muslin.physics"):
    try:
        importlib.import_module(name)
        print("HERE", name)
    except ImportError:
        pass
return x
"""
    record = attack(
        {FILE: newton(body, "import importlib\n")},
        spoils=(TASK,),
        level=level,
        assignment="solids",
        instead_of={},
    )
    needs(record, "solution and hidden data out of sight")
    assert "HERE" not in record[TASK].output


def test_functions_that_the_grader_answers_are_those_a_student_has_at_home(attack):
    """By position and by name, whole numbers and lists: honest code sees no difference."""
    body = """
assert objective.__name__ == "objective" and gradient.__name__ == "gradient"
assert type(objective(x)) is float and gradient(x=x).shape == (4,)
assert objective([1, 2, 3, 4]) == objective(np.array([1.0, 2.0, 3.0, 4.0]))
d = solve(b=-gradient(x), H=hessian(x))
assert np.allclose(hessian(x) @ d, -gradient(x))
return right(x, objective, gradient, hessian, solve, tolerance, most_steps)
"""
    above = honest(FILE, "solids") + "\nright = newtons_method\n"
    record = attack({FILE: newton(body, above)}, assignment="solids")
    assert record[TASK].status == "passed"
    assert record[TASK].score == tasks.assignment("solids").tasks[TASK].points
