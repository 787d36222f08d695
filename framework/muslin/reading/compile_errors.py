"""Taichi's errors about a student function, in the student's terms.

Taichi answers a mistake with its whole call stack, its own files included. What a student needs of it is the
last line of *their* file, the expression in it, what is wrong, and, for common mistakes, what to write instead.
"""

from __future__ import annotations

import inspect
import re
from collections import Counter
from collections.abc import Callable
from typing import Any

from muslin import reading
from muslin.base import paths
from muslin.base.engine import inside
from muslin.base.errors import MuslinError, NotImplementedYet, StudentCodeError
from muslin.reading.borrowed import Borrowed
from muslin.reading.page import sentence

#: Pattern in "offending source line, newline, message" -> what to do. The first that matches is given.
ADVICE: tuple[tuple[str, str], ...] = (
    (
        r"Return inside non-static",
        "Name the result before the branch, change it inside, return it once at the end.",
    ),
    (
        r"numpy array can be used",
        "A NumPy array does not come into a Taichi function: write ti.Vector([...]) or ti.Matrix([...]) inside.",
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
        r"Matrix\.identity\(\) missing|Invalid data type",
        "The type comes first: ti.Matrix.identity(float, 3).",
    ),
    (r"Matrix\.diag\(\) missing", "A diagonal matrix is diag(v), after from muslin.given import diag."),
    (r"(cols|rows)\(\) takes", "It takes one list: ti.Matrix.cols([a, b, c])."),
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
    (
        r"atomic_add|atomic_sub",
        "A number cannot take a vector: begin with ti.Vector([0.0, 0.0, 0.0]) instead of 0.0.",
    ),
    (r"for '\*': a \dx\d matrix and a vector", "A matrix times a vector is A @ v."),
    (
        r"for '[+-]':.*(matrix and a vector|vector of \d and a \dx)",
        "A matrix and a vector have different sizes: a b^T is a.outer_product(b), A v is A @ v, and a diagonal matrix "
        "is diag(v).",
    ),
    (
        r"for '/':.* and a vector",
        "Nothing is divided by a vector of another size: a vector's length is v.norm().",
    ),
    (r"for dot is not a vector", "dot takes two vectors: a matrix times a vector is A @ v."),
    (
        r"unsupported operand.*(matrix|vector of \d) and a (\d|vector)",
        "The two have different sizes: + and - need the same size, * works entry by entry, @ multiplies matrices.",
    ),
    (
        r"matmul|dimension mismatch",
        "Look at the shapes: a (n, k) matrix takes a (k,) vector or a (k, m) matrix.",
    ),
    (r"AsyncFunctionDef", "A task is a plain function: write def, without async."),
    (
        r"Unsupported node",
        "That part of Python does not run inside a Taichi function: plain formulas, if and for do.",
    ),
    (
        r"\b(max|min)\([^,]*\)(.*\n)+.*one of them is a tensor",
        "The largest entry of a vector is v.max(), the smallest v.min(); max(a, b) takes two numbers.",
    ),
    (
        r"ti\.Vector\((.*\n)+.*(PrimitiveType|one of them is a tensor)",
        "The entries of ti.Vector([...]) are numbers, and a vector stands among them: vectors are added with +, and "
        "put side by side with ti.Matrix.cols([a, b, c]).",
    ),
    (
        r"dt->is<PrimitiveType>",
        "Vectors cannot stand in ti.Matrix([...]): use ti.Matrix.rows([...]) or ti.Matrix.cols.",
    ),
    (
        r"one of them is a tensor",
        "A vector stands where a number is needed: its components are v[0], v[1], v[2].",
    ),
    (
        r"ti\.svd\((.*\n)+.*(AssertionError|<ti\.Expr>\.m)",
        "ti.svd takes square matrices only, and is not exact enough: write U, s, V = svd(F, N), after "
        "from muslin.given import svd.",
    ),
    (r"ti\.(sym_)?eig\(", "Eigenvalues are not needed here: the handout gives them in closed form."),
    (
        r"Expected a square matrix",
        "Only a square matrix has an inverse and a determinant; D.transpose() @ D is square where D is not.",
    ),
    (
        r"conditions must be an integer; found a (vector|matrix|\dx)",
        "The condition is a vector: * of two vectors works entry by entry, a.dot(b) is a number.",
    ),
    (
        r"transpose\(\)` cannot apply to a vector",
        "A vector has no transpose: a^T b is a.dot(b), and a b^T is a.outer_product(b).",
    ),
    (r"class 'str'", "A string is no number, vector or matrix: take it out."),
    (r"Cannot unpack type", "Return as many values as the task asks for, separated by commas."),
    (r"get_num_elements", "The rows of a matrix must be equally long."),
    (
        r"List indices must be integers or slices, not tuple",
        "A list cannot be indexed by a list: a comma is missing between the two rows in square brackets, or write "
        "A[i, j] for an entry of a matrix.",
    ),
    (
        r"List indices must be integers",
        "A Python list needs a number known in advance: use if, or ti.static(range(3)).",
    ),
    (
        r"shape of non-tensor",
        "One side of @ is a number: @ is a product of matrices and vectors, * multiplies by a number. Is a whole "
        "vector meant, or diag(v), where one component stands?",
    ),
    (r"number of targets", "Return as many values as the task asks for, separated by commas."),
    (r"tuple index out of range", "It is called with too few arguments: a.cross(b), a.dot(b)."),
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
    """The error about a student function, short and about the student's own file.

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
    name = getattr(function, "__name__", "function")
    source = inspect.getsourcefile(inspect.unwrap(function)) or ""
    found: BaseException | None = error
    while found is not None:
        if isinstance(found, Borrowed):
            return found.placed(name, source, _calls(str(error), source))
        if isinstance(found, MuslinError):
            known = None if isinstance(found, NotImplementedYet) else foreseen(function, str(found))
            return known or found
        found = found.__cause__ or found.__context__
    text = re.sub(r" \(version \d+\)(?=\")", "", inside.said(str(error)).strip())
    source = re.sub(r" \(version \d+\)$", "", source)
    where, snippet = _last_place(text, source)
    if (outside := re.search(rf"-?\d+ is {inside.OUT_OF_RANGE} .*", text)) is not None:
        said = f"{where}: {name} reads or writes out of range: {outside[0].rstrip('.')}."
        return StudentCodeError("\n".join(part for part in (said, snippet) if part))
    message = _message(text)
    if "NotImplementedError" in snippet:
        stub = re.findall(r"in (\w+):", text)[-1]
        return NotImplementedYet(f"not implemented yet: {stub}, which {name} calls ({where})")
    if (known := foreseen(function, where)) is not None:
        return known
    if len(re.findall(rf"in {re.escape(name)}:", text)) > 20 or "maximum recursion depth" in text:
        # the innermost line is wherever the stack happened to end; the commonest is that of the call
        lines = Counter(re.findall(rf'File "{re.escape(source)}", line (\d+), in {re.escape(name)}:', text))
        where = f"{paths.shown(source)}, line {lines.most_common(1)[0][0]}" if lines else where
        return StudentCodeError(
            f"{where}: {name} calls itself, and a Taichi function cannot.", "Write a loop."
        )
    note = _noticed(function, where, snippet)
    if note is not None and not snippet:
        where, snippet = f"{where}, line {note.line}", f"    {reading.row(function, note.line)}"
    return StudentCodeError(told(name, where, snippet, message, note.words if note else ""))


def foreseen(function: Callable[..., Any], said: str) -> StudentCodeError | None:
    """What a reader sees would keep a function from running, where it has failed in that line, or in none."""
    line = re.search(r", line (\d+)(?=:|$)", said.split("\n")[0])
    fatal = [note for note in reading.of(function) if note.fatal]
    note = next((note for note in fatal if line is None or note.line == int(line[1])), None)
    if note is None:
        return None
    file = re.sub(r" \(version \d+\)$", "", inspect.unwrap(function).__code__.co_filename)
    row, name = reading.row(function, note.line), getattr(function, "__name__", "function")
    words = f"{paths.shown(file)}, line {note.line}: {name} cannot be run as it is.\n    {row}"
    return StudentCodeError(f"{words}\n{sentence(note.words, row)}")


def told(name: str, where: str, snippet: str, message: str, noticed: str = "") -> str:
    """An error in lines: where, the source, what Taichi says, what to write instead.

    Parameters
    ----------
    name : str
        The function.
    where : str
        File and line.
    snippet : str
        The source there, underlined.
    message : str
        What Taichi says is wrong.
    noticed : str
        What a reader notices in that line; it knows more than Taichi's words do.
    """
    code = "\n".join(line for line in snippet.split("\n") if line.strip(" ^\t"))  # without underlining
    advice = noticed or next(
        (tip for pattern, tip in ADVICE if re.search(pattern, f"{code}\n{message}", re.I)), ""
    )
    if (advice and re.search(NOISE, message)) or (noticed and re.search(KNOWN, message)):
        message = ""
    lines = [f"{where}: {name} does not compile.", snippet, message[:1].upper() + message[1:]]
    return "\n".join(line for line in [*lines, sentence(advice, code)] if line)


#: What Taichi says that is said again, and better, by what is noticed in the line.
KNOWN = r"has no attribute|is not defined|Did you mean to use|^Unsupported node"

#: Words of Taichi's insides, which say nothing to anyone.
NOISE = r"^\[\w+\.(cpp|h):|__name__|^AssertionError|^MatMult|make_matrix|^TypedConstant|inspect\._empty"


def _noticed(function: Callable[..., Any], where: str, snippet: str = "") -> reading.Note | None:
    """What a reader notices in the line an error is about, best in what is underlined; without a line, first."""
    line = re.search(r", line (\d+)$", where)
    notes = [note for note in reading.of(function) if not note.compiles]
    if line is not None:
        notes = [note for note in notes if note.line == int(line[1])]
        marked = _underlined(snippet)
        notes.sort(key=lambda note: not (marked in note.code or note.code in marked))
    return notes[0] if notes else None


def _underlined(snippet: str) -> str:
    """What is underlined in the first source line of an error."""
    rows = snippet.split("\n")
    if len(rows) < 2 or set(rows[1]) - set(" ^"):
        return ""
    return "".join(letter for letter, mark in zip(rows[0], rows[1], strict=False) if mark == "^").strip()


def misshapen(function: Callable[..., Any], title: str, which: int, got: str, asked: str) -> StudentCodeError:
    """What is said of a result of the wrong shape.

    Parameters
    ----------
    function : taichi function
    title : str
        What it is called.
    which : int
        The result, from 0.
    got, asked : str
        What it is and what it must be: "a number", "a vector of 3", "a 3x3 matrix", `LIST`.
    """
    task = getattr(function, "task", None)
    names = [value.name for value in task.results] if task is not None else []
    part = f" as result {which + 1}" if which or len(names) > 1 else ""
    said = f"{title} returns {got}{part} where {asked} is asked."
    found = reading.returned(function)
    if found is None:
        return StudentCodeError(said)
    line, code = found
    source = re.sub(r" \(version \d+\)$", "", inspect.getsourcefile(inspect.unwrap(function)) or "")
    advice = next((tip for pattern, tip in SHAPES if re.search(pattern, f"{code}\n{got} -> {asked}")), "")
    birth = reading.born(function, which) if got == "a number" else None
    if birth is not None:
        zero = "ti.Vector([0.0, 0.0, 0.0])" if "vector" in asked else "ti.Matrix.zero(float, 3, 3)"
        name = code.removeprefix("return").split(",")[which].strip()
        advice = (
            f"{name} is born as a number in line {birth.lineno}, and stays one: begin with {name} = {zero}."
        )
    elif len(names) > 1 and not advice:
        advice = f"The results are, in this order: {', '.join(names)}."
    lines = (f"{paths.shown(source)}, line {line}: {said}", f"    {code}", advice)
    return StudentCodeError("\n".join(text for text in lines if text))


#: What a result is called that is not one value.
LIST = "a Python list, which is not a vector,"

#: Pattern in "expression returned, newline, what it is -> what is asked" -> what to do.
SHAPES: tuple[tuple[str, str], ...] = (
    (r"\[(.*\n)+a Python list", "Write ti.Vector([...]) or ti.Matrix([...]) around it."),
    (r"a Python list", "Several values stand in one name there: take them apart, as in U, s, V = svd(F, N)."),
    (
        r"abs\((.*\n)+a vector of \d -> a number",
        "abs of a vector works entry by entry: its length is v.norm().",
    ),
    (
        r"\*(.*\n)+a vector of \d -> a number",
        "* and ** of vectors work entry by entry: a.dot(b) is a number, and a.dot(a) the squared length.",
    ),
    (
        r"[<>](.*\n)+a vector of \d -> a number",
        "Vectors are compared entry by entry: a vector's length is v.norm().",
    ),
    (
        r"@(.*\n)+a vector of 3 -> a 3x3 matrix",
        "A matrix times a vector is a vector: a diagonal matrix is diag(v), a b^T is a.outer_product(b).",
    ),
    (r"a vector of (2 -> a vector of 3|3 -> a vector of 4)", "An entry is missing."),
    (r"a vector of (3 -> a vector of 2|4 -> a vector of 3)", "It has an entry too many."),
    (r"a 2x2 matrix -> a 3x3 matrix", "A row and a column are missing, be they zero."),
    (r"a 2x3 matrix -> a 3x3 matrix", "A row is missing."),
    (r"a 3x2 matrix -> a 3x3 matrix", "A column is missing."),
    (r"a \dx1 matrix -> a vector", "A matrix of one column is no vector: write ti.Vector([a, b, c])."),
    (
        r"a vector of (4|9) -> a \dx\d",
        "A matrix is written row by row: ti.Matrix([[a, b, c], [d, e, f], [g, h, i]]).",
    ),
    (r"a number -> a vector of 3", "A vector is ti.Vector([a, b, c])."),
    (
        r"a number -> a \dx\d matrix",
        "A matrix is ti.Matrix([[...], [...], [...]]), or a product of matrices.",
    ),
)


def _calls(text: str, source: str) -> list[tuple[str, int]]:
    """Functions of the student's file that an error came through, innermost last, each with its line."""
    places = re.findall(rf'File "{re.escape(source)}", line (\d+), in (\w+):\n', text)
    return [(name, int(line)) for line, name in places]


def _last_place(text: str, source: str) -> tuple[str, str]:
    """`file, line n` of the last mention of the student's file, and the source lines shown there."""
    places = list(re.finditer(rf'File "{re.escape(source)}", line (\d+), in \w+:\n', text)) if source else []
    if not places:
        return paths.shown(source) if source else "your function", ""
    snippet = []
    for line in text[places[-1].end() :].split("\n"):
        if not line.startswith((" ", "\t")):
            break
        snippet.append(line)
    return f"{paths.shown(source)}, line {places[-1][1]}", "\n".join(snippet)


def _message(text: str) -> str:
    """What Taichi says is wrong: the end of the text, without stack or source lines."""
    last = text.split("\n")[-1] if text else "no message"
    last = re.sub(r"^(\w+\.)*(\w+(Error|Exception)): ", "", last)
    last = re.sub(r"the object (<class '[\w.]+'>) in Taichi scope\..*", r"\1", last)
    last = last.replace("<class 'list'>", "a Python list")
    last = re.sub(r"<class 'taichi\.[\w. ]+'>|'Taichi Expression' object", "a vector, matrix or number", last)
    last = re.sub(r"'?\[Tensor \((\d+), (\d+)\) \w+\]'?", r"a \1x\2 matrix", last)
    last = re.sub(r"'?\[Tensor \((\d+)\) \w+\]'?", r"a vector of \1", last)
    return last.replace("module 'taichi.lang.matrix_ops'", "a vector or matrix").rstrip(".?") + "."
