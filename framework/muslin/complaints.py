"""Taichi's complaints about a student function, in the student's terms.

Taichi answers a mistake with its whole call stack, its own files included. What a student needs of it is the
last line of *their* file, the expression in it, what is wrong, and, for common mistakes, what to write instead.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from typing import Any

from muslin import paths
from muslin.engine import inside
from muslin.errors import MuslinError, NotImplementedYet, StudentCodeError

#: Pattern in "offending source line, newline, message" -> what to do. The first that matches is given.
ADVICE: tuple[tuple[str, str], ...] = (
    (
        r"Return inside non-static",
        "Name the result before the branch, change it inside, return it once at the end.",
    ),
    (
        r"Did you mean to use `ti\.|0-dimensional (numpy )?array|\b(np|numpy|math)\.",
        "NumPy and math do not run inside a Taichi function: use ti.sqrt, ti.max, .dot, .cross.",
    ),
    (
        r"'list' object has no attribute|multiply sequence|concatenate list|'list' and|and 'list'",
        "A Python list is not a vector: write ti.Vector([...]).",
    ),
    (
        r"Cannot loop over|Input to ti.static|when calling `(enumerate|zip|reversed)`",
        "Loop over numbers: for k in ti.static(range(3)), and take v[k], or A[k, :] for a row.",
    ),
    (
        r"when calling `(sum|min|max|len|sorted)`",
        "Vectors have methods for that: v.sum(), v.max(), v.min(). Of single numbers, ti.max(a, b).",
    ),
    (
        r"when calling `\w+`",
        "Write @ti.func on the line above the def of the function that is called.",
    ),
    (
        r"Expected 2 indices, got 1",
        "An entry of a matrix is A[i, j], a row is A[i, :].",
    ),
    (r"no attribute 'T'", "The transpose is A.transpose()."),
    (
        r"Name \"\w+\" is not defined",
        "Is it spelt like that elsewhere? A variable born inside an if or a loop is unknown after it: give it a "
        "value before.",
    ),
    (r"\w *\^ *\w[^\n]*\n(.*\n)*?.*unsupported operand", "Power is ** in Python."),
    (
        r"unsupported operand.*(matrix|vector of \d) and a (\d|vector)",
        "The two have different sizes: + and - need the same size, * works entry by entry, @ multiplies matrices.",
    ),
    (
        r"matmul|dimension mismatch",
        "Look at the shapes: a (n, k) matrix takes a (k,) vector or a (k, m) matrix.",
    ),
    (
        r"Unsupported node",
        "That part of Python does not run inside a Taichi function: plain formulas, if and for do.",
    ),
    (
        r"dt->is<PrimitiveType>",
        "Vectors cannot stand in ti.Matrix([...]): use ti.Matrix.rows([...]) or ti.Matrix.cols.",
    ),
    (r"get_num_elements", "The rows of a matrix must be equally long."),
    (
        r"List indices must be integers",
        "A Python list needs a number known in advance: use if, or ti.static(range(3)).",
    ),
    (r"number of targets", "Return as many values as the task asks for, separated by commas."),
    (r"inspect._empty", "It is called with the wrong number of arguments."),
    (r"<class 'function'>", "A method lacks its brackets: m.norm(), F.transpose()."),
    (r"[Mm]ake_matrix\(\) takes", "ti.Vector and ti.Matrix take one list: ti.Vector([a, b, c])."),
    (
        r"'Expr' object has no attribute '__name__'",
        "An argument hides the function of that name: it is a vector here.",
    ),
    (
        r"'function' object has no attribute",
        "That name is a function here, not one of this task's arguments.",
    ),
    (r"TypedConstant", "None and other Python objects are not numbers."),
    (r"has no attribute '(x0|x1|x2|X)'", "Vectors have no such part: v[0], v[1], v[2] are the components."),
    (
        r"unsupported operand",
        "The two sides have different shapes, or one is not a number, vector or matrix.",
    ),
)


def explained(error: BaseException, function: Callable[..., Any]) -> MuslinError:
    """The complaint about a student function, short and about the student's own file.

    Parameters
    ----------
    error : exception
        What Taichi raised while compiling or running a kernel around `function`.
    function : taichi function

    Returns
    -------
    MuslinError
        The one inside `error` if there is one (a wrong shape, a stub), else a `StudentCodeError`.
    """
    found: BaseException | None = error
    while found is not None:
        if isinstance(found, MuslinError):
            return found
        found = found.__cause__ or found.__context__
    name = getattr(function, "__name__", "function")
    source = inspect.getsourcefile(inspect.unwrap(function)) or ""
    text = re.sub(r" \(version \d+\)(?=\")", "", inside.said(str(error)).strip())
    source = re.sub(r" \(version \d+\)$", "", source)
    where, snippet = _last_place(text, source)
    if (outside := re.search(rf"-?\d+ is {inside.OUT_OF_RANGE} .*", text)) is not None:
        return StudentCodeError(f"{where}: {name} reads or writes out of range: {outside[0].rstrip('.')}.")
    message = _message(text)
    if "NotImplementedError" in snippet:
        stub = re.findall(r"in (\w+):", text)[-1]
        return NotImplementedYet(f"not implemented yet: {stub}, which {name} calls ({where})")
    if len(re.findall(rf"in {re.escape(name)}:", text)) > 20 or "maximum recursion depth" in text:
        return StudentCodeError(
            f"{where}: {name} calls itself, and a Taichi function cannot.", "Write a loop."
        )
    code = "\n".join(line for line in snippet.splitlines() if line.strip(" ^\t"))  # without underlining
    advice = next((tip for pattern, tip in ADVICE if re.search(pattern, f"{code}\n{message}", re.I)), "")
    if advice and re.match(
        r"\[\w+\.(cpp|h):", message
    ):  # an assertion of Taichi's compiler says nothing to anyone
        message = ""
    lines = [f"{where}: {name} does not compile.", snippet, message[:1].upper() + message[1:], advice]
    return StudentCodeError("\n".join(line for line in lines if line))


def _last_place(text: str, source: str) -> tuple[str, str]:
    """`file, line n` of the last mention of the student's file, and the source lines shown there."""
    places = list(re.finditer(rf'File "{re.escape(source)}", line (\d+), in \w+:\n', text)) if source else []
    if not places:
        return paths.shown(source) if source else "your function", ""
    snippet = []
    for line in text[places[-1].end() :].splitlines():
        if not line.startswith((" ", "\t")):
            break
        snippet.append(line)
    return f"{paths.shown(source)}, line {places[-1][1]}", "\n".join(snippet)


def _message(text: str) -> str:
    """What Taichi says is wrong: the end of the text, without stack or source lines."""
    last = text.splitlines()[-1] if text else "no message"
    last = re.sub(r"^(\w+\.)*(\w+(Error|Exception)): ", "", last)
    last = re.sub(r"the object (<class '[\w.]+'>) in Taichi scope\..*", r"\1", last)
    last = last.replace("<class 'list'>", "a Python list")
    last = re.sub(r"<class 'taichi\.[\w. ]+'>|'Taichi Expression' object", "a vector, matrix or number", last)
    last = re.sub(r"'?\[Tensor \((\d+), (\d+)\) \w+\]'?", r"a \1x\2 matrix", last)
    last = re.sub(r"'?\[Tensor \((\d+)\) \w+\]'?", r"a vector of \1", last)
    return last.replace("module 'taichi.lang.matrix_ops'", "a vector or matrix").rstrip(".?") + "."
