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
from muslin.errors import MuslinError, StudentCodeError

#: Pattern in "offending source line, newline, message" -> what to do. The first that matches is given.
ADVICE: tuple[tuple[str, str], ...] = (
    (
        r"Return inside non-static",
        "Name the result before the branch, change it inside, return it once at the end.",
    ),
    (
        r"\b(np|numpy|math)\.",
        "NumPy and math do not run inside a Taichi function: use ti.sqrt, ti.max, .dot, .cross.",
    ),
    (
        r"matmul|dimension mismatch",
        "Look at the shapes: a (n, k) matrix takes a (k,) vector or a (k, m) matrix.",
    ),
    (r"Unsupported node \"?Raise", "A Taichi function cannot raise."),
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
    text = str(error).strip()
    where, snippet = _last_place(text, source)
    message = _message(text)
    if len(re.findall(rf"in {re.escape(name)}:", text)) > 20 or "maximum recursion depth" in text:
        return StudentCodeError(
            f"{where}: {name} calls itself, and a Taichi function cannot.", "Write a loop."
        )
    advice = next((tip for pattern, tip in ADVICE if re.search(pattern, f"{snippet}\n{message}")), "")
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
    last = re.sub(r"'?\[Tensor \((\d+), (\d+)\) \w+\]'?", r"a \1x\2 matrix", last)
    last = re.sub(r"'?\[Tensor \((\d+)\) \w+\]'?", r"a vector of \1", last)
    return last.replace("module 'taichi.lang.matrix_ops'", "a vector or matrix").rstrip(".?") + "."
