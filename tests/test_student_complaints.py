"""The commonest Taichi mistakes, each told in the student's words: file, line, expression, what to write instead."""

from pathlib import Path

import pytest

import muslin
from muslin import reading
from muslin.base import engine
from muslin.student import checking, explaining

RCG = "right_cauchy_green"
HEAD = "import math\n\nimport numpy as np\nimport taichi as ti\n\n\n"
HELPER = "def helper(s):\n    y = 0.0\n    for k in range(2):\n        y += s[k]\n    return y\n\n\n"
SIMPLE = "def helper(x):\n    return x * x\n\n\n"

#: mistake -> (task, what stands above it, body, line in the body that is named, what to write instead)
MISTAKES = {
    "a Python list in a kernel": (RCG, "", "v = [1.0, 2.0, 3.0]\nreturn F @ v", 1, "v = ti.Vector([...])"),
    "a Python list times a number": ("dpsi_ds", "", "v = [1.0, 2.0, 3.0]\nreturn v * 2.0", 1, "v = ti.Vector([...])"),
    "a Python list returned": ("dpsi_ds", "", "return [mu, lam, 0.0]", 1, "ti.Vector([...])"),
    "a matrix of the wrong size, multiplied": (
        RCG, "", "A = ti.Matrix([[1.0, 0.0], [0.0, 1.0]])\nreturn F @ A", 2, "Look at the shapes"),
    "a matrix of the wrong size, added": (
        RCG, "", "A = ti.Matrix([[1.0, 0.0], [0.0, 1.0]])\nreturn F + A", 2, "need the same size"),
    "a matrix of the wrong size, returned": (
        RCG, "", "return ti.Matrix([[1.0, 0.0], [0.0, 1.0]])", None,
        "returns a 2x2 matrix where a 3x3 matrix is asked"),
    "a vector of the wrong size, returned": ("dpsi_ds", "", "return ti.Vector([mu, lam])", None, "An entry is missing"),
    "a vector between matrices": (
        "dpsi_dF", "", "return U @ dpsi_ds @ V.transpose()", None, "a diagonal matrix is diag(v)"),
    "a vector between matrices, added": (RCG, "", "v = F[:, 0]\nreturn F @ v + F", 2, "a diagonal matrix is diag(v)"),
    "a matrix divided by a vector": (RCG, "", "v = F[:, 0]\nreturn F / v", 2, "a vector's length is v.norm()"),
    "a dot product of a matrix": ("nodal_force", "", "return P.dot(grad_phi)", 1, "a matrix times a vector is A @ v"),
    "a vector compared": (
        "sphere_contact", "", "return ti.cast(x - c < r, ti.i32), x", None, "Vectors are compared entry by entry"),
    "integer division": ("psi", "", "half = 1 // 2\nreturn half * mu * (s[0] - 1) ** 2", 1, "write /"),
    "a variable born as an integer": ("psi", "", "y = 0\ny += mu * (s[0] - 1) ** 2\nreturn y", 1, "write 0.0 for 0"),
    "a vector born of integers": (
        "dpsi_ds", "", "p = ti.Vector([0, 0, 0])\np[0] = 2 * mu * (s[0] - 1)\nreturn p", 1, "write 0.0 for 0"),
    "a float32 literal": ("psi", "", "half = ti.f32(0.1)\nreturn half * mu * (s[0] - 1) ** 2", 1, "leave it out"),
    "a return in a branch": ("psi", "", "if s[0] > 1:\n    return mu\nreturn lam", 2, "end with return y"),
    "a missing @ti.func above the task": ("psi", None, "return mu", None, "Write @ti.func on the line above def psi"),
    "a missing @ti.func above a helper": ("psi", HELPER, "return mu * helper(s)", 1, "above def helper (line 7)"),
    "a missing @ti.func that compiles": ("psi", SIMPLE, "return mu * helper(s[0])", 1, "above def helper (line 7)"),
    "calling numpy": ("psi", "", "return np.sqrt(mu)", 1, "write ti.sqrt"),
    "calling numpy on a matrix": (RCG, "", "return np.transpose(F) @ F", 1, "write A.transpose()"),
    "calling numpy, which compiles": (RCG, "", "return np.dot(F, F)", 1, "A @ B for matrices"),
    "calling numpy for an array": ("dpsi_ds", "", "return np.array([mu, lam, 0.0])", 1, "write ti.Vector([...])"),
    "calling math": ("psi", "", "return math.sqrt(mu)", 1, "write ti.sqrt"),
    "changing an argument": (RCG, "", "F = F.transpose()\nreturn F.transpose() @ F", 1, "a new variable"),
    "changing an entry": (RCG, "", "F[0, 0] = 1.0\nreturn F.transpose() @ F", 1, "a new variable"),
    "recursion": ("psi", "", "return psi(s, mu, lam)", 1, "calls itself"),
    "a loop over a vector": ("psi", "", "t = 0.0\nfor x in s:\n    t += x\nreturn t", 2, "for k in ti.static(range("),
    "a loop over the rows of a matrix": (
        RCG, "", "t = 0.0\nfor row in F:\n    t += row[0]\nreturn F * t", 2, "A[k, :]"),
    "a loop that enumerates": ("psi", "", "t = 0.0\nfor k, x in enumerate(s):\n    t += x\nreturn t", 2, "take v[k]"),
    "a list indexed in a loop": (
        "psi", "", "w = [1.0, 2.0]\nt = 0.0\nfor k in range(2):\n    t += w[k]\nreturn t", 4,
        "ti.static(range(3))"),
    "the sum of a vector": ("psi", "", "return sum(s)", 1, "v.sum()"),
    "numpy's transpose": (RCG, "", "return F.T @ F", 1, "A.transpose()"),
    "two square brackets": (RCG, "", "return F * F[0][0]", 1, "A[i, j]"),
    "a variable born in a branch": ("psi", "", "if s[0] > 1:\n    y = 2.0\nreturn y", 3, "give it a value before"),
    "a power as in mathematics": ("psi", "", "return mu ^ 2", 1, "a power is **"),
    # a missing sign, a missing bracket
    "a number in front of a bracket": ("psi", "", "return 2(s[0] - 1) * mu", 1, "write 2 * (s[0] - 1)"),
    "a fraction in front of a bracket": (
        "interpolate", "", "return 1.0(phi[0] * x0 + x1 + x2)", 1, "write 1.0 * (phi[0] * x0 + x1 + x2)"),
    "an argument in front of a bracket": ("psi", "", "return mu(s[0] - 1) ** 2", 1, "write mu * (s[0] - 1)"),
    "a bracket in front of a bracket": ("psi", "", "return (s[0] - 1)(s[1] - 1)", 1, "(s[0] - 1) * (s[1] - 1)"),
    "round brackets for an entry": ("psi", "", "return mu * s(0)", 1, "write s[0]"),
    "a sum that goes on in the next line": (
        "psi", "", "y = mu * s[0]\n+ lam / 2 * s[1]\nreturn y", 2, "stands in brackets ( )"),
    "a sum that goes on after the return": (
        "psi", "", "return mu * s[0]\n+ lam / 2 * s[1]", 2, "stands in brackets ( )"),
    "a comparison for an assignment": ("psi", "", "y = 0.0\ny == mu\nreturn y", 2, "write = to give a value"),
    "a method without brackets": (
        "dn_dx", "", "n = x1.cross(x2).normalized\nreturn n.outer_product(n)", 1, "lacks its brackets"),
    # results
    "one result of two": (
        "sphere_contact", "", "d = x - c\nreturn ti.cast(d.norm() < r, ti.i32)", 2, "two are asked (hit, n)"),
    "a variable for two results": (
        "sphere_contact", "", "d = x - c\nn = d.normalized()\nreturn n", 3, "two are asked (hit, n)"),
    "an argument for two results": ("sphere_contact", "", "return x", 1, "two are asked (hit, n)"),
    "three stretches in two names": ("psi", "", "a, b = s\nreturn mu * a * b", 1, "has 3 components"),
    "a decimal comma at the end": ("psi", "", "return lam * s[0] + 0,5 * mu", 1, "has a point"),
    "three results of two": ("sphere_contact", "", "d = x - c\nreturn 1, d, d", 2, "two are asked (hit, n)"),
    "three numbers for a vector": ("dpsi_ds", "", "return mu, lam, 0.0", 1, "one vector is ti.Vector([a, b, c])"),
    "None returned": ("psi", "", "return None", 1, "write return and the result"),
    "results in the wrong order": ("sphere_contact", "", "d = x - c\nreturn d, 1", 2, "in this order: hit, n"),
    "a number for a vector": ("dpsi_ds", "", "return 2 * mu * (s[0] - 1)", 1, "ti.Vector([a, b, c])"),
    "a column for a vector": ("dpsi_ds", "", "return ti.Matrix([[mu], [lam], [0.0]])", 1, "write ti.Vector"),
    "nine numbers for a matrix": (RCG, "", "return ti.Matrix([1.0, 0, 0, 0, 1, 0, 0, 0, 1])", 1, "row by row"),
    "a vector that begins as a number": (
        "filter_velocity", "", "w = 0.0\nif n.dot(v) < 0:\n    w = v - n.dot(v) * n\nreturn w", 4,
        "w = ti.Vector([0.0, 0.0, 0.0])"),
    "a sum of vectors begun with 0.0": (
        "interpolate", "", "x = 0.0\nx += phi[0] * x0\nreturn x", 2, "ti.Vector([0.0, 0.0, 0.0])"),
    "the length as in mathematics": (
        "sphere_contact", "", "d = x - c\nreturn ti.cast(abs(d) < r, ti.i32), d", 2, "v.norm()"),
    # names of other libraries
    "vectors in a vector": ("interpolate", "", "return ti.Vector([phi[0] * x0, phi[1] * x1])", 1, "are added with +"),
    "vectors in a matrix": ("dn_dx", "", "return ti.Matrix([x0, x1, x2])", 1, "ti.Matrix.cols"),
    "normalize": ("dn_dx", "", "n = x1.normalize()\nreturn n.outer_product(n)", 1, "n = m.normalized()"),
    "normalized, thrown away": (
        "dn_dx", "", "n = x1.cross(x2)\nn.normalized()\nreturn n.outer_product(n)", 2, "n = n.normalized()"),
    "ti.cross": ("dn_dx", "", "n = ti.cross(x1, x2)\nreturn n.outer_product(n)", 1, "write a.cross(b)"),
    "ti.dot": ("filter_velocity", "", "return v - ti.dot(n, v) * n", 1, "a.dot(b) for vectors"),
    "ti.diag": ("dpsi_dF", "", "return U @ ti.diag(dpsi_ds)", 1, "from muslin.given import diag"),
    "ti.norm": ("sphere_contact", "", "return ti.cast(ti.norm(x - c) < r, ti.i32), x", 1, "write a.norm()"),
    "ti.eye": ("dn_dx", "", "return ti.eye(3)", 1, "ti.Matrix.identity(float, 3)"),
    "an identity without a type": ("dn_dx", "", "return ti.Matrix.identity(3)", 1, "ti.Matrix.identity(float, 3)"),
    "ti.vector": ("dpsi_ds", "", "return ti.vector([mu, lam, 0.0])", 1, "ti.Vector([a, b, c])"),
    "a vector of three arguments": ("dpsi_ds", "", "return ti.Vector(mu, lam, 0.0)", 1, "ti.Vector([a, b, c])"),
    "columns that are not in a list": ("dn_dx", "", "return ti.Matrix.cols(x0, x1, x2)", 1, "ti.Matrix.cols([a, b"),
    "a name almost Taichi's": ("psi", "", "return ti.sqr(mu) + ti.sqrtt(mu)", 1, "a ** 2"),
    "inv": (RCG, "", "return F.inv()", 1, "A.inverse()"),
    "det": (RCG, "", "return F * F.det()", 1, "A.determinant()"),
    "a misspelt method": (RCG, "", "return F.transpos() @ F", 1, "v.transpose()"),
    "a row": (RCG, "", "return F * F.row(0)[0]", 1, "A[i, :]"),
    "a shape": (RCG, "", "return F * F.shape[0]", 1, "the number itself"),
    "the transpose of a vector": ("dn_dx", "", "return x0 @ x1.transpose()", 1, "a.outer_product(b)"),
    "np.linalg": (
        "sphere_contact", "", "return ti.cast(np.linalg.norm(x - c) < r, ti.i32), x", 1, "write a.norm()"),
    "the svd of a matrix that is not square": (
        "dpsi_dF", "", "A, B, C = ti.svd(ti.Matrix.cols([U[:, 0], U[:, 1]]))\nreturn U", 1, "svd(F, N)"),
    "the inverse of a matrix that is not square": (
        "phi", "", "D = ti.Matrix.cols([X1 - X0, X2 - X0])\nreturn D.inverse() @ X", 2, "D.transpose() @ D is square"),
    "the largest entry": ("psi", "", "return ti.Vector([max(s), mu])[0]", 1, "v.max()"),
    "* of a matrix and a vector": ("nodal_force", "", "return -h * area * P * grad_phi", 1, "A @ v"),
    "* for the outer product": (
        "deformation_gradient", "", "F = ti.Matrix.cols([x0, x1, x2])\nreturn F + x0 * N", 2, "a.outer_product(b)"),
    "an if about a vector": (
        "filter_velocity", "", "d = n * v\nif d < 0:\n    d = -d\nreturn v", 2, "a.dot(b) is a number"),
    "two things in one line": (
        "sphere_contact", "", "hit = 0\nif x.norm2() < r^2:\n    hit = 1\nreturn hit, x", 2, "write a.norm_sqr()"),
    "a square of a vector": ("kinetic_energy", "", "return rho * v0**2", 1, "a.dot(a) the squared length"),
    "a product of vectors": ("kinetic_energy", "", "return rho*(v0*v1)", 1, "a.dot(b) is a number"),
    "the largest of a vector": ("psi", "", "return ti.Vector([ti.max(s), mu]).sum()", 1, "v.max()"),
    "ti.Matrix.col": ("dn_dx", "", "return ti.Matrix.col([x0, x1, x2])", 1, "ti.Matrix.cols"),
    "a value called like a function": ("dpsi_dF", "", "return dpsi_ds(U, V, U)", 1, "dpsi_ds is a value here"),
    "a method without its argument": ("dn_dx", "", "m = x0.cross()\nreturn m.outer_product(m)", 1, "a.cross(b)"),
    "a decimal comma": ("psi", "", "return 0,5 * lam", 1, "has a point"),
    "MATLAB's end": ("psi", "", "y = mu\nend\nreturn y", 2, "Python has no end"),
    # names nobody has given a value
    "X0 for x0": ("interpolate", "", "return phi[0] * X0", 1, "did you mean x0?"),
    "a misspelt argument": ("psi", "", "return lamb * s[0]", 1, "did you mean lam?"),
    "a misspelt variable": ("filter_velocity", "", "v_new = v\nreturn v_nwe", 2, "did you mean v_new?"),
    "s0 for s[0]": ("psi", "", "return mu * (s0 - 1)", 1, "an entry is s[0]"),
    "a Greek letter": ("psi", "", "return μ * s[0]", 1, "write mu"),
    "the identity as in mathematics": ("dn_dx", "", "return I - x0.outer_product(x0)", 1, "ti.Matrix.identity"),
    "a given function not imported": (RCG, "", "return diag(F[:, 0])", 1, "from muslin.given import diag"),
    "a bare sqrt": ("psi", "", "return sqrt(mu)", 1, "write ti.sqrt"),
    "a class's self": ("psi", "", "return self.mu * s[0]", 1, "self belongs to classes"),
    "a name of the slides": ("dn_dx", "", "return m.outer_product(m)", 1, "othing here gives m a value"),
    "a variable of both branches": (
        "filter_velocity", "", "if n.dot(v) < 0:\n    w = v - n\nelse:\n    w = v\nreturn w", 5,
        "the if or loop of line"),
    # the debugger, and parts of Python Taichi does not compile
    "breakpoint": ("psi", "", "breakpoint()\nreturn mu", 1, "muslin explain psi shows your variables"),
    "pdb": ("psi", "", "import pdb; pdb.set_trace()\nreturn mu", 1, "muslin explain psi shows your variables"),
    "input": ("psi", "", "a = input()\nreturn mu", 1, "cannot stop or ask"),
    "try": ("psi", "", "y = 0.0\ntry:\n    y = mu\nexcept ZeroDivisionError:\n    y = 1.0\nreturn y", 2, "with an if"),
    "raise": ("psi", "", "if mu < 0:\n    raise ValueError('mu')\nreturn mu", 2, "take it out"),
    "lambda as a function": ("psi", "", "f = lambda x: x * x\nreturn f(mu)", 1, "a helper with @ti.func"),
    "a function in a function": ("psi", "", "def f(x):\n    return x\nreturn f(mu)", 1, "move it above"),
    "a generator": ("psi", "", "return sum(s[k] for k in range(2))", 1, "one by one"),
    "is for ==": ("mass_block", "", "m = 1.0\nif i is j:\n    m = 2.0\nreturn m", 2, "write =="),
    "a product in place": (RCG, "", "C = F.transpose()\nC @= F\nreturn C", 2, "write C = C @ F"),
    "len for a length": ("sphere_contact", "", "d = x - c\nl = len(d)\nreturn 1, d / l", 2, "its length is d.norm()"),
    "a string": ("psi", "", "y = 'mu'\nreturn mu", 1, "no number"),
}  # fmt: skip


def written(folder, task, above, body):
    """A file with one function; returns the line its body begins in."""
    table = muslin.tasks.assignment()
    entry = table.tasks[task]
    head = f"{HEAD}{above or ''}{'' if above is None else '@ti.func' + chr(10)}"
    head += f"def {task}({', '.join(a.name for a in entry.arguments)}):\n"
    text = head + "".join(f"    {line}\n" for line in body.splitlines())
    (folder / entry.file).write_text(text, encoding="utf-8")
    return head.count("\n") + 1


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_common_mistake_is_told_with_its_line_and_what_to_write(mistake, tmp_path, monkeypatch):
    task, above, body, line, instead = MISTAKES[mistake]
    monkeypatch.chdir(tmp_path)
    first = written(tmp_path, task, above, body)
    (report,) = checking.examine(Path(), "cloth", (task,))
    assert report.status in (checking.WRONG, checking.ERROR)
    told = "\n".join([report.message, report.mistake, *report.notes])
    assert instead in told
    assert "site-packages" not in told
    assert "taichi.lang" not in told
    if line is not None:
        assert f"line {first + line - 1}" in told
        expression = body.splitlines()[line - 1].strip()
        quoted = [note.partition(", ")[2].rpartition(": ")[0] for note in report.notes]
        assert expression in report.message or any(part and part in expression for part in quoted)


FUNC = "@ti.func\ndef psi(s, mu, lam):\n    return mu * s[0]\n"
TI = "import taichi as ti\n\n"

#: mistake -> (the file strain_energy.py, line that is named, what to write instead)
FILES = {
    "a test call at the bottom": (
        f"{TI}{FUNC}print(psi(ti.Vector([1.0, 1.0, 1.0]), 1.0, 1.0))\n", 6, "muslin check psi"),
    "a test call with nothing in it": (f"{TI}{FUNC}psi()\n", 6, "Take this line out"),
    "an assert at the bottom": (f"{TI}{FUNC}assert psi(ti.Vector([1.0, 1.0, 1.0]), 1.0, 1.0) > 0\n", 6, "Take this"),
    "muslin.load at the bottom": (f"{TI}{FUNC}import muslin\nmuslin.load('/nowhere')\n", 7, "Take this line out"),
    "breakpoint at the bottom": (f"{TI}{FUNC}breakpoint()\n", 6, "Take that line out"),
    "input at the bottom": (f"{TI}{FUNC}x = input()\n", 6, "Take that line out"),
    "ti.init": (f"{TI}ti.init(arch=ti.cpu)\n{FUNC}", 3, "take that line out"),
    "a file that is not there": (f"{TI}open('values.txt')\n{FUNC}", 3, "importing the file fails: FileNotFoundError"),
    "an error of the system's": (f"{TI}raise OSError(5, 'no')\n{FUNC}", 3, "importing the file fails: OSError"),
    "an error without a word": (f"{TI}raise OSError\n{FUNC}", 3, "importing the file fails: OSError.\n"),
    "an error no one catches": (f"{TI}raise GeneratorExit\n{FUNC}", 3, "importing the file fails: GeneratorExit"),
    "an error that fails": (
        f"{TI}class E(Exception):\n    def __str__(self):\n        raise OSError\nraise E\n{FUNC}", 6,
        "importing the file fails: E."),
    "a function out of a text": (f"{TI}exec('''{FUNC}''')\n", None, "def psi(...): on the line below"),
    "a function without a name": (
        f"{TI}psi = ti.func(lambda s, mu, lam: mu)\n", None, "def psi(...): on the line below"),
    "anything else at the bottom": (f"{TI}{FUNC}print(1 / 0)\n", 6, "take out what else stands there"),
    "a helper in a file of one's own": (f"{TI}from utils import f\n{FUNC}", 3, "into strain_energy.py itself"),
    "another task file": (f"{TI}import stress\n{FUNC}", 3, "into strain_energy.py itself"),
    "a relative import": (f"{TI}from .stress import dpsi_dF\n{FUNC}", 3, "into strain_energy.py itself"),
    "a library that is not there": (f"{TI}import no_such_library\n{FUNC}", 3, "are not needed"),
    "taichi misspelt": (f"import tachi as ti\n{FUNC}", 1, "Did you mean taichi?"),
    "a given name misspelt": (f"{TI}from muslin.given import diagg\n{FUNC}", 3, "Did you mean diag?"),
    "taichi not imported": (FUNC, 1, "import taichi as ti at the top"),
    "no decorator": (TI + FUNC.removeprefix("@ti.func\n"), 3, "Write @ti.func"),
    "a kernel": (TI + FUNC.replace("func", "kernel", 1), 3, 'not "@ti.kernel"'),
    "a kernel with types": (
        f"{TI}@ti.kernel\ndef psi(s: ti.math.vec3, mu: float, lam: float) -> float:\n    return mu\n", 4,
        "instead of @ti.kernel"),
    "a decorator with brackets": (TI + FUNC.replace("func", "func()", 1), 3, "without brackets"),
    "a real function": (TI + FUNC.replace("func", "real_func", 1), 3, 'not "@ti.real_func"'),
    "async": (TI + FUNC.replace("def", "async def"), 4, "without async"),
    "a decorator that is none": (TI + FUNC.replace("func", "function", 1), 3, "Write @ti.func above def psi"),
    "a decorator without ti": (TI + FUNC.replace("ti.func", "func", 1), 3, "Write @ti.func above def psi"),
    "arguments in another order": (TI + FUNC.replace("mu, lam", "lam, mu"), 4, "(s, mu, lam), in this order"),
    "an argument missing": (TI + FUNC.replace("mu, lam", "mu"), 4, "must take (s, mu, lam)"),
    "self": (TI + FUNC.replace("(s", "(self, s"), 4, "must take (s, mu, lam)"),
    "another name": (TI + FUNC.replace("psi", "Psi"), 4, "def psi(s, mu, lam):"),
    "a method": (f"{TI}class A:\n    @ti.func\n    def psi(s, mu, lam):\n        return mu\n", 5, "first column"),
    "nothing returned": (TI + FUNC.replace("return", "y ="), 4, "End it with return"),
    "twice": (f"{TI}{FUNC}{FUNC.replace('mu *', '2.0 *')}", 7, "lines 4 and 7"),
    "the stub again below": (f"{TI}{FUNC}{FUNC.replace('return mu * s[0]', 'raise NotImplementedError')}", None,
        "lines 4 and 7"),
    "the stub's last line left": (f"{TI}{FUNC}    raise NotImplementedError\n", None, "raise NotImplementedError out"),
    "a return outside": (f"{TI}{FUNC}return 1\n", 6, "outside of every function"),
    "nothing": ("", None, "def psi(s, mu, lam):"),
    "a notebook": ('{"cells": [], "metadata": {}}', None, "notebook"),
    "a missing * in another function": (f"{TI}{FUNC}\n\ndef g(x):\n    return 2 x\n", 9, "2 * x"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", FILES)
def test_what_is_wrong_with_a_file_is_told_with_its_line_and_what_to_write(
    mistake, tmp_path, monkeypatch, capfd
):
    if mistake == "a decorator with brackets" and engine.chosen().name == "quadrants":
        pytest.skip("Quadrants takes @ti.func() too")
    text, line, instead = FILES[mistake]
    monkeypatch.chdir(tmp_path)
    (tmp_path / "utils.py").write_text(f"{TI}@ti.func\ndef f(x):\n    return x\n", encoding="utf-8")
    (tmp_path / "strain_energy.py").write_text(text, encoding="utf-8")
    (report,) = checking.examine(Path(), "cloth", ("psi",))
    assert report.status != checking.GREEN
    told = "\n".join([report.message, *report.notes])
    assert instead in told
    assert "site-packages" not in told
    assert str(tmp_path) not in told
    if line is not None:
        assert f"line {line}" in told
    assert "(Pdb)" not in "".join(capfd.readouterr())


def test_check_explain_and_the_record_tell_the_same(tmp_path):
    written(tmp_path, RCG, "", "return F.T @ F")
    text = (tmp_path / "strain_energy.py").read_text(encoding="utf-8")
    text += "\n\n@ti.func\ndef psi(s, mu, lam):\n    y = mu * s[0]\n    + lam * s[1]\n    return y\n"
    (tmp_path / "strain_energy.py").write_text(text, encoding="utf-8")
    does_not_run, wrong = checking.examine(tmp_path, "cloth", (RCG, "psi"))
    explained = ["\n".join(explaining.steps(tmp_path, "cloth", name, None)) for name in (RCG, "psi")]
    record = muslin.grade(tmp_path)
    recorded = {task.name: task.message for task in record.tasks}

    def plain(told):
        return (
            " ".join(told.split())
            .replace(f"{tmp_path.as_posix().lstrip('/')}/", "")
            .replace("/strain", "strain")
        )

    assert "write A.transpose()" in does_not_run.message
    assert plain(does_not_run.message) == plain(recorded[RCG])
    assert plain(does_not_run.message) in plain(explained[0])
    (note,) = wrong.notes
    assert "stands in brackets" in note
    assert note in recorded["psi"]
    assert note in explained[1]


def test_a_right_function_is_read_without_a_word():
    folder = Path(__file__).resolve().parent.parent / "solutions" / "cloth"
    table = muslin.tasks.read_assignment(folder)
    for task in table.tasks.values():
        text = (folder / task.file).read_text(encoding="utf-8")
        assert reading.notes(text, task.name) == []


def test_what_is_not_python_is_read_as_nothing():
    assert reading.notes("def f(:\n", "f") == []


RIGHT = {
    "a helper": (
        "psi", SIMPLE, "return mu * (helper(s[0] - 1) + helper(s[1] - 1)) + lam / 2 * helper(s[0] + s[1] - 2)"),
    "a loop": (
        "psi", "", "y = lam / 2 * (s[0] + s[1] - 2) ** 2\nfor k in ti.static(range(2)):\n"
        "    y += mu * (s[k] - 1) ** 2\n"
        "return y"),
    "a formula in brackets": (
        "psi", "", "return (mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2)\n        + lam / 2 * (s[0] + s[1] - 2) ** 2)"),
    "a branch": (
        "filter_velocity", "", "d = n.dot(v)\nw = v\nif d < 0:\n    w -= d * n\nreturn w"),
    "a choice": ("filter_velocity", "", "d = n.dot(v)\nreturn v - d * n if d < 0 else v"),
    "two results in names": (
        "sphere_contact", "", "d = x - c\nn = ti.Vector([0.0, 1.0, 0.0])\nhit = 0\nif d.norm() > 0:\n"
        "    n = d.normalized()\nif d.norm() < r:\n    hit = 1\nreturn hit, n"),
    "components": (
        "psi", "", "return mu * ((s.x - 1) ** 2 + (s.y - 1) ** 2) + lam / 2 * (s.x + s.y - 2) ** 2"),
    "taichi's mathematics": ("filter_velocity", "", "d = ti.math.dot(n, v)\nreturn v - ti.min(d, 0.0) * n"),
    "a print": ("right_cauchy_green", "", "print(f'F {F}')\nassert F[0, 0] < 1e30, 'large'\nreturn F.transpose() @ F"),
}  # fmt: skip


@pytest.mark.parametrize("way", RIGHT)
def test_other_ways_to_write_it_right_are_read_without_a_word(way, tmp_path):
    task, above, body = RIGHT[way]
    written(tmp_path, task, above.replace("def", "@ti.func\ndef"), body)
    (report,) = checking.examine(tmp_path, "cloth", (task,))
    assert report.status == checking.GREEN, report.message
    assert (
        reading.notes((tmp_path / muslin.tasks.assignment().tasks[task].file).read_text("utf-8"), task) == []
    )
