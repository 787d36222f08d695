"""Attack 32: nesting of a hundred thousand brackets, an expression of 10^5 terms, unrolled loops without end.

Defence: the deadline covers importing and compiling.
"""

from attacking import TASKS, honest

WAYS = {
    "collision.py": "x = " + "(" * 100_000 + ")" * 100_000,
    "stress.py": "x = " + "-" * 400_000 + "1",
    "stiffness.py": "x = " + "+".join(["1"] * 150_000),
}
UNROLLED = """
@ti.func
def deformation_gradient(x0, x1, x2, dphi_dX, N):
    F = ti.Matrix.zero(ti.f64, 3, 3)
    for k in ti.static(range(10**8)):
        F = F @ F
    return F

@ti.func
def dn_dx(x0, x1, x2, i):
    return ti.Matrix.identity(ti.f64, 3)
"""


def test_the_deadline_covers_compiling(attack):
    files = {name: f"{text}\n{honest(name)}" for name, text in WAYS.items()}
    files["deformation_gradient.py"] = "import taichi as ti\n" + UNROLLED
    spoiled = tuple(name for name, task in TASKS.items() if task.file in files)
    record = attack(files, spoils=spoiled, deadline=3.0)
    assert record["deformation_gradient"].status == "error"
    assert "was stopped" in record["deformation_gradient"].message
