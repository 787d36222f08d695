"""A student's file is read as Python reads it: its lines, its encoding; and what Python cannot read is told plainly."""

import ast
import codecs

import numpy as np
import pytest

import muslin
from muslin.base.errors import MuslinError, StudentCodeError
from muslin.reading import source, syntax
from muslin.student import resetting, workspace

#: Characters at which str.splitlines breaks a line, and Python does not.
NO_LINE_ENDS = ["\u2028", "\u2029", "\x85", "\f", "\v", "\x1c", "\x1d", "\x1e"]

TWO = """import taichi as ti


@ti.func
def psi(s, mu, lam):
    # {odd} and the rest
{between}    return mu * s[0] + lam
"""


@pytest.mark.parametrize("odd", NO_LINE_ENDS)
def test_lines_are_counted_as_python_counts_them(odd):
    text = f"# a{odd}b\nx = 1\r\n# c{odd}\ry = 2"
    tree = ast.parse(text)
    assert [node.lineno for node in tree.body] == [2, 4]
    assert syntax.lines(text)[3] == "y = 2"
    assert "".join(syntax.lines(text)) == text


@pytest.mark.parametrize("odd", NO_LINE_ENDS)
def test_odd_characters_in_a_comment_change_nothing(odd, tmp_path):
    text = TWO.format(odd=odd * 3, between="\f\n")
    (tmp_path / "strain_energy.py").write_bytes(f"# slides{odd}\n{text}".encode())
    f = muslin.load(tmp_path)
    assert muslin.evaluate(f.psi, s=np.ones((1, 3)), mu=2.0, lam=3.0).tolist() == [5.0]


def test_a_form_feed_before_an_indented_line_is_no_column(tmp_path):
    text = TWO.format(odd="", between="  \f    mu2 = mu\n")
    (tmp_path / "strain_energy.py").write_text(text, encoding="utf-8")
    f = muslin.load(tmp_path)
    assert muslin.evaluate(f.psi, s=np.ones((1, 3)), mu=2.0, lam=3.0).tolist() == [5.0]


@pytest.mark.parametrize("odd", NO_LINE_ENDS)
def test_reset_takes_the_function_and_leaves_its_neighbours(odd, tmp_path):
    workspace.start("cloth", tmp_path / "mine")
    mine = workspace.find(tmp_path / "mine")
    path = mine.folder / "strain_energy.py"
    given = path.read_text(encoding="utf-8")
    done = given.replace("raise NotImplementedError", "return 1.0")
    path.write_bytes(f"# one{odd * 5}\n{done}".encode())
    resetting.reset(mine, "psi")
    head, tail = given.split("@ti.func\ndef psi")
    body, after = tail.split("@ti.func\ndef dpsi_ds")
    kept = [part.replace("raise NotImplementedError", "return 1.0") for part in (head, after)]
    expected = f"# one{odd * 5}\n{kept[0]}@ti.func\ndef psi{body}@ti.func\ndef dpsi_ds{kept[1]}"
    assert path.read_bytes().decode() == expected


@pytest.mark.parametrize("encoding", ["cp1252", "latin-1", "utf-8", "iso-8859-15", "koi8-r"])
def test_a_declared_encoding_is_read_and_kept(encoding, tmp_path):
    word = "für" if encoding != "koi8-r" else "сила"
    text = f"# -*- coding: {encoding} -*-\n# {word}\n" + TWO.format(odd="", between="")
    path = tmp_path / "strain_energy.py"
    path.write_bytes(text.encode(encoding))
    assert muslin.evaluate(muslin.load(tmp_path).psi, s=np.ones((1, 3)), mu=2.0, lam=3.0).tolist() == [5.0]
    assert source.read(path) == text
    source.write(path, text + f"# {word}\n")
    assert path.read_bytes() == (text + f"# {word}\n").encode(encoding)


def test_a_letter_the_declared_encoding_lacks_is_refused_and_nothing_is_lost(tmp_path):
    path = tmp_path / "a.py"
    path.write_bytes(b"# coding: ascii\n")
    with pytest.raises(MuslinError, match="lacks 'é'"):
        source.write(path, "# coding: ascii\n# é\n")
    assert path.read_bytes() == b"# coding: ascii\n"


@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
@pytest.mark.parametrize("newline", [b"\n", b"\r\n"])
def test_writing_keeps_line_ends_and_byte_order_mark(mark, newline, tmp_path):
    path = tmp_path / "a.py"
    path.write_bytes(mark + b"# \xc3\xa9" + newline + b"y = 1" + newline)
    source.write(path, source.read(path))
    assert path.read_bytes() == mark + b"# \xc3\xa9" + newline + b"y = 1" + newline


UNREADABLE = {
    "UTF-16": ("x = 1\n".encode("utf-16"), "UTF-16"),
    "Latin-1 without a declaration": ("a = 1\nb = 2\n\n# für\n".encode("latin-1"), "f.py, line 4: this is not UTF-8"),
    "Latin-1 in the first line": ("# für\n".encode("latin-1"), "f.py, line 1: this is not UTF-8"),
    "declared as what it is not": (b"# coding: ascii\n\n\n# \xff\n", "f.py, line 4: this is not ascii"),
    "an unknown encoding": (b"# coding: latin-99\n", "does not know"),
    "no encoding of text": (b"# coding: rot13\n", "does not know"),
}  # fmt: skip


@pytest.mark.parametrize("kind", UNREADABLE)
def test_what_is_no_text_is_told_with_its_line(kind):
    data, words = UNREADABLE[kind]
    with pytest.raises(StudentCodeError) as caught:
        source.decoded(data, "f.py")
    assert words in str(caught.value)
    assert "UTF-8" in str(caught.value)


#: mistake -> (body of a function, line in it, what to write instead)
UNGRAMMATICAL = {
    "lambda as a variable": ("y = lambda / 2\nreturn y", 1, "write lam"),
    "lambda gets a value": ("lambda = 2.0\nreturn 1.0", 1, "write lam"),
    "another word of Python": ("in = 2.0\nreturn 1.0", 1, "choose another"),
    "a missing * after a number": ("return 2 mu", 1, "2 * mu"),
    "a missing * without a blank": ("return 2mu", 1, "2 * mu"),
    "a missing * between names": ("return mu lam", 1, "mu * lam"),
    "a missing * before a bracket": ("return 1/2 mu (s[0] - 1)", 1, "2 * mu(...)"),
    "a missing * after a bracket": ("return (s[0] - 1) mu", 1, ") * mu"),
    "a missing @": ("return U diag(p)", 1, "U @ diag"),
    "a sum that goes on, indented": ("return mu\n    + lam", 2, "brackets ( )"),
    "a sum that goes on after its sign": ("return mu +\n    lam", 1, "brackets ( )"),
    "a blank after the backslash": ("return mu + \\ \n    lam", 1, "A space stands after"),
    "a minus from a PDF": ("return mu − lam", 1, "write -."),
    "a dash": ("return mu – lam", 1, "write -."),
    "a times sign": ("return mu × lam", 1, "write *."),
    "a square from a PDF": ("return mu²", 1, "write ** 2."),
    "quotation marks of a word processor": ("print(“mu”)", 1, 'write ".'),
    "a blank from a web page": ("return mu\u00a0+ lam", 1, "invisible"),
    "a bracket never closed": ("y = (mu + (lam\nreturn y", 1, "Count the brackets"),
    "a bracket too many": ("return (mu)) + lam", 1, "Count the brackets"),
    "brackets that do not fit": ("return (mu[0)]", 1, "Count the brackets"),
    "a string never closed": ("print('mu)\nreturn mu", 1, "quotation mark"),
    "a missing colon": ("if mu > 0\n    lam = 1\nreturn mu", 1, "ends with a colon"),
    "= for ==": ("if mu = lam:\n    lam = 1\nreturn mu", 1, "=="),
    "an if without a body": ("if mu > 0:\nlam = 1\nreturn mu", 2, "four spaces"),
    "a line too far right": ("y = mu\n  z = mu\nreturn mu", 2, "another column"),
    "a line in between": ("if mu > 0:\n        y = mu\n    z = mu\nreturn mu", 3, "another column"),
    "else if": ("if mu > 0:\n    y = 1\nelse if mu < 0:\n    y = 2\nreturn mu", 3, "elif"),
    "&&": ("if mu > 0 && lam > 0:\n    y = 1\nreturn mu", 1, "and for &&"),
    "!": ("if !(mu > 0):\n    y = 1\nreturn mu", 1, "not for !"),
    "++": ("k++\nreturn mu", 1, "k += 1"),
    "a question mark": ("return mu > 0 ? mu : lam", 1, "inside an if"),
    "a type before a name": ("double y = 2.0\nreturn y", 1, "y = ..."),
    "braces": ("if (mu > 0) { y = mu; }\nreturn mu", 1, "four spaces"),
    "a comment of C": ("// the energy\nreturn mu", 1, "#"),
    "a comment of C behind a line": ("y = 0  // not yet\nreturn y", 1, "begins with #"),
    "a longer comment of C behind a line": ("y = mu;  // the part of mu\nreturn y", 1, "begins with #"),
    "a division that rounds, in a line with another mistake": ("y = mu // 2 lam\nreturn y", 1, "2 * lam"),
    "MATLAB's transpose": ("return F' * F", 1, "A.transpose()"),
    "MATLAB's product": ("return mu .* lam", 1, "Write *"),
    "MATLAB's row": ("return [mu lam 0.0]", 1, "commas"),
    "LaTeX": (r"return \mu + \lambda", 1, "without backslash"),
    "bars": ("return |d| < r", 1, "v.norm()"),
    "=<": ("if mu =< 0:\n    y = 1\nreturn mu", 1, "<= for =<"),
    "<>": ("if mu <> 0:\n    y = 1\nreturn mu", 1, "!= for <>"),
    "then": ("if mu < 0 then\n    y = 1\nreturn mu", 1, "a colon for then"),
    ":=": ("y := mu\nreturn y", 1, "y = ..."),
    "let": ("let y = mu\nreturn y", 1, "y = ..."),
    "a dot for an entry": ("return mu * s.0", 1, "s[0]"),
    "return with a colon": ("return: mu", 1, "No colon"),
    "return with a name": ("return y = mu", 1, "the formula alone"),
    "a prompt": (">>> return mu", 1, "delete it"),
    "a merge": ("<<<<<<< HEAD\nreturn mu", 1, "keep one"),
    "print without brackets": ("print mu\nreturn mu", 1, "take it out"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", UNGRAMMATICAL)
def test_what_python_cannot_read_is_told_with_line_caret_and_what_to_write(mistake):
    body, line, instead = UNGRAMMATICAL[mistake]
    text = "def f(s, mu, lam):\n" + "".join(f"    {row}\n" for row in body.split("\n"))
    with pytest.raises(StudentCodeError) as caught:
        syntax.parsed(text, "f.py")
    first, shown, carets, *rest = str(caught.value).split("\n")
    assert first.startswith(f"f.py, line {line + 1}: ")
    assert shown.strip() == body.split("\n")[line - 1].strip(" ")[: len(shown.strip())]
    assert set(carets) == {" ", "^"}
    assert instead in "\n".join(rest)


def test_a_docstring_that_is_never_closed_is_found_where_it_opens():
    text = 'def f(x):\n    """a\n    return x\n\n\ndef g(x):\n    """It\'s b."""\n    return x\n'
    with pytest.raises(StudentCodeError, match='Line 2 opens a docstring with """'):
        syntax.parsed(text, "f.py")


def test_a_long_line_is_shown_around_the_caret():
    with pytest.raises(StudentCodeError) as caught:
        syntax.parsed("y = " + "1 + " * 200 + "2 mu\n", "f.py")
    _, shown, carets, *_ = str(caught.value).split("\n")
    assert len(shown) < 120
    assert shown[carets.index("^")] in "2m"


@pytest.mark.parametrize("text", ["x = 1\ny\0 = 2\n", "(" * 5000, "x = " + "-" * 100_000 + "1"])
def test_what_breaks_the_parser_is_still_a_sentence(text):
    with pytest.raises(StudentCodeError, match=r"f\.py.*: Python cannot read this"):
        syntax.parsed(text, "f.py")


FILE = """import taichi as ti

HALF = 0.5


@ti.func
def f(x):
    return HALF * x


@ti.func
def g(x):
    y = 2 * (x + 1)
    return y


@ti.func
def h(x):
    return x
"""

#: what is written instead -> (of what, functions that cannot be read, line and words of the first)
BROKEN = {
    "a missing *": ("2 * (x", "2 (x + 1) y", {"g"}, "line 13: "),
    "a bracket never closed": ("(x + 1)", "(x + 1", {"g"}, "line 13: "),
    "a docstring never closed": ("    y =", '    """\n    y =', {"g"}, "line 13: "),
    "no body": ("    y = 2 * (x + 1)\n    return y\n", "", {"g"}, "line 15: "),
    "a def without a colon": ("def g(x):", "def g(x)", {"g"}, "line 12: "),
    "a def without a comma": ("def g(x):", "def g(x y):", {"g"}, "line 12: "),
    "a def one space too far right": ("def g(x):", " def g(x):", {"g"}, "line 12: "),
    "a def four spaces too far right": ("def g(x):", "    def g(x):", {"g"}, "line 12: "),
    "no decorator": ("@ti.func\ndef g(x):", "def g(x", {"g"}, "line 11: "),
    "a closing bracket below": ("(x + 1)\n", "(x + 1 1\n)\n", {"g"}, "line 13: "),
    "two of them": ("HALF * x", "HALF x", {"f"}, "line 8: "),
    "the last": ("    return x\n", "    return x x\n", {"h"}, "line 19: "),
}


@pytest.mark.parametrize("mistake", BROKEN)
def test_a_function_python_cannot_read_is_told_from_the_others(mistake):
    right, wrong, names, words = BROKEN[mistake]
    assert right in FILE
    text, broken = source.legible(FILE.replace(right, wrong), {"f", "g", "h"}, "f.py")
    assert set(broken) == names
    assert words in str(next(iter(broken.values())))
    read = source.Source(text)
    assert set(read.functions) == {"f", "g", "h"} - names
    for name, function in read.functions.items():
        assert (
            read.piece(function.lines).strip()
            == source.Source(FILE).piece(source.Source(FILE).functions[name].lines).strip()
        )
        assert FILE.replace(right, wrong).split("\n")[function.node.lineno - 1] == f"def {name}(x):"


def test_an_indented_def_is_told_to_begin_in_the_first_column():
    _, broken = source.legible(FILE.replace("def g(x):", " def g(x):"), {"f", "g", "h"}, "f.py")
    assert "take the spaces in front of def out" in str(broken["g"])


def test_two_functions_python_cannot_read_are_each_told_with_their_line():
    _, broken = source.legible(
        FILE.replace("HALF * x", "HALF x").replace("2 * (", "2 ((("), {"f", "g"}, "f.py"
    )
    assert "line 8: " in str(broken["f"])
    assert "line 13: " in str(broken["g"])


UNCLEAR = {
    "a helper": ("2 * (x", "2 (x + 1) y", {"f", "h"}),
    "above the functions": ("HALF = 0.5", "HALF = = 0.5", {"f", "g", "h"}),
    "a name that is not there": ("def g(", "def (", {"f", "g", "h"}),
    "def misspelt": ("def g(", "df g(", {"f", "g", "h"}),
    "a body in the first column": ("    y = 2", "y = 2", {"f", "g", "h"}),
    "a constant below": ("    return y\n", "    return y y\nTWICE = 2\n", {"f", "g", "h"}),
    "a merge": ("    y =", "<<<<<<< HEAD\n    y =", {"f", "g", "h"}),
    "the name of another": ("def g(x):\n    y", "def f(x):\n    y y", {"g", "h"}),
}


@pytest.mark.parametrize("mistake", UNCLEAR)
def test_where_it_cannot_be_told_what_is_broken_the_file_is(mistake):
    right, wrong, names = UNCLEAR[mistake]
    assert right in FILE
    text = FILE.replace(right, wrong)
    with pytest.raises(StudentCodeError) as whole:
        syntax.parsed(text, "f.py")
    with pytest.raises(StudentCodeError) as caught:
        source.legible(text, names, "f.py")
    assert str(caught.value) == str(whole.value)


def test_a_docstring_in_the_first_column_hides_no_function():
    text = FILE.replace("    y =", '    """\nof g\n    """\n    y =').replace(
        "    return x\n", "    return x x\n"
    )
    read, broken = source.legible(text, {"f", "g", "h"}, "f.py")
    assert set(broken) == {"h"}
    assert set(source.Source(read).functions) == {"f", "g"}
