"""What belongs in place of an expression, made of the function's own symbols with one operation or two.

Where it is known what an expression would have to be (`muslin.grading.needs`), thousands of others are tried in one
sweep of NumPy, with no text worked out: all sums, products, lengths, entries, outer products ... of the symbols that
are known in that line, and all pairs of those. What is said is what kind of thing belongs there and, where that is
short, how it is written.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from muslin.grading.needs import IMPOSSIBLE, Slope, Target
from muslin.reading.arithmetic import METHODS
from muslin.reading.repairs.pieces import Form, Repair, code, text_of

if TYPE_CHECKING:
    from muslin.grading.repairing import Search

#: Most symbols of a kind, most made of one operation, most of those that are multiplied, longest side of a matrix.
SYMBOLS, MADE, FACTORS, SIDE = 12, 160, 80, 4

#: Nodes in whose place something is looked for, at most.
PLACES = 24

#: Most of what fits in a place that is worked out to the end; longest of it that is shown [characters].
MOST_MADE, SHOWN = 6, 40

#: Whether values, (n, b, ...), fit in a place: (n,) of bool.
Fits = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Made:
    """An expression and its value.

    Attributes
    ----------
    text, words : str
        How it is written, and what is said of it.
    value : ndarray, (b, ...)
    """

    text: str
    words: str
    value: np.ndarray

    @property
    def size(self) -> int:
        """How much it is made of."""
        return 1 + len(re.findall(r"[-+*/@,(\[]", self.text))


#: Methods by what they are called, of a vector, of two vectors, of a matrix.
OF_VECTOR = {
    "norm": "the length of {0}",
    "norm_sqr": "the squared length of {0}",
    "normalized": "{0}, made of length one",
    "sum": "the sum of the entries of {0}",
}
OF_VECTORS = {
    "dot": "the dot product of {0} and {1}",
    "cross": "the cross product of {0} and {1}",
    "outer_product": "the outer product of {0} and {1}",
}
OF_MATRIX = {
    "transpose": "the transpose of {0}",
    "inverse": "the inverse of {0}",
    "trace": "the trace of {0}",
    "determinant": "the determinant of {0}",
    "norm_sqr": "the sum of the squares of the entries of {0}, which is tr({0}^T {0}),",
}


class Kit:
    """All that is made of some symbols with at most one operation, by shape.

    Parameters
    ----------
    symbols : dict of ndarray, (b, ...)
    """

    def __init__(self, symbols: Mapping[str, np.ndarray]) -> None:
        self.plain: dict[Form, list[Made]] = {}
        self.made: dict[Form, list[Made]] = {}
        for name, value in symbols.items():
            same = self.plain.setdefault(value.shape[1:], [])
            if len(same) < SYMBOLS:
                same.append(Made(name, name, value))
        for form, made in list(self.plain.items()):
            if len(form) == 1:
                entries = [
                    Made(f"{v.text}[{k}]", f"{v.text}[{k}]", v.value[:, k])
                    for v in made
                    for k in range(form[0])
                ]
                self.plain[()] = self.plain.get((), []) + entries
        for form, made in self.plain.items():
            self._of_one(form, made)
            self._of_two(made)
        self._of_different()

    def _add(self, text: str, words: str, value: Any) -> None:
        value = np.asarray(value, dtype=np.float64)
        same = self.made.setdefault(value.shape[1:], [])
        if len(same) < MADE and np.isfinite(value).any():
            same.append(Made(text, words, value))

    def _of_one(self, form: Form, made: Sequence[Made]) -> None:
        for one in made:
            called = {0: {}, 1: OF_VECTOR, 2: OF_MATRIX}[len(form)]
            square = len(form) != 2 or form[0] == form[1]
            for method, words in called.items():
                if square or method in ("transpose", "norm_sqr"):
                    self._try(method, f"{one.text}.{method}()", words.format(one.text), one.value)
            if not form:
                self._add(f"({one.text} - 1)", f"{one.text} less 1", one.value - 1)
                self._add(f"{one.text} ** 2", f"the square of {one.text}", one.value**2)
                self._add(f"abs({one.text})", f"the absolute value of {one.text}", np.abs(one.value))
            elif len(form) == 1:
                matrix = one.value[:, :, None] * np.eye(form[0])
                self._add(f"diag({one.text})", f"the diagonal matrix of {one.text}", matrix)
            elif max(form) <= SIDE:
                for i, j in np.ndindex(*form):
                    self._add(f"{one.text}[{i}, {j}]", f"an entry of {one.text}", one.value[:, i, j])
                for k in range(form[0]):
                    self._add(f"{one.text}[{k}, :]", f"row {k} of {one.text}", one.value[:, k])
                for k in range(form[1]):
                    self._add(f"{one.text}[:, {k}]", f"column {k} of {one.text}", one.value[:, :, k])
        groups: dict[str, list[Made]] = {}
        for one in made if len(form) == 1 else ():
            groups.setdefault(re.sub(r"\d+$", "", one.text), []).append(one)
        for group in groups.values():
            if len(group) > 2:
                total, names = sum(one.value for one in group), " + ".join(one.text for one in group)
                self._add(f"({names})", f"the sum of {names.replace(' + ', ', ')}", total)
                self._add(
                    f"({names}) / {len(group)}",
                    f"the mean of {names.replace(' + ', ', ')}",
                    total / len(group),
                )

    def _of_two(self, made: Sequence[Made]) -> None:
        for a, b in itertools.combinations(made, 2):
            self._add(f"({a.text} - {b.text})", f"the difference {a.text} - {b.text}", a.value - b.value)
            self._add(f"({b.text} - {a.text})", f"the difference {b.text} - {a.text}", b.value - a.value)
            self._add(f"({a.text} + {b.text})", f"the sum of {a.text} and {b.text}", a.value + b.value)
            if a.value.ndim == 1:
                self._add(
                    f"({a.text} * {b.text})", f"the product of {a.text} and {b.text}", a.value * b.value
                )
                self._add(f"({a.text} / {b.text})", f"the quotient {a.text} / {b.text}", a.value / b.value)
                self._add(f"({b.text} / {a.text})", f"the quotient {b.text} / {a.text}", b.value / a.value)
        for a, b in itertools.product(made, repeat=2):
            if a.value.ndim == 2:
                for method, words in OF_VECTORS.items():
                    if method == "outer_product" or a is not b:
                        said = words.format(a.text, b.text)
                        self._try(method, f"{a.text}.{method}({b.text})", said, a.value, b.value)

    def _of_different(self) -> None:
        matrices = [one for form, made in self.plain.items() if len(form) == 2 for one in made]
        vectors = [one for form, made in self.plain.items() if len(form) == 1 for one in made]
        turned = [
            Made(f"{m.text}.transpose()", f"the transpose of {m.text}", m.value.swapaxes(1, 2))
            for m in matrices
        ]
        for a, b in itertools.product([*matrices, *turned], repeat=2):
            if a.value.shape[2] == b.value.shape[1]:
                words = f"the product of {a.words} and {b.words}"
                self._add(f"{a.text} @ {b.text}", words, a.value @ b.value)
        for a, v in itertools.product([*matrices, *turned], vectors):
            if a.value.shape[2] == v.value.shape[1]:
                words = f"the product of {a.words} and {v.text}"
                self._add(f"{a.text} @ {v.text}", words, (a.value @ v.value[..., None])[..., 0])

    def _try(self, method: str, text: str, words: str, *values: np.ndarray) -> None:
        try:
            self._add(text, words, METHODS[method](*values))
        except Exception:  # it does not exist for this shape
            return

    def all(self, form: Form) -> list[Made]:
        """All of a shape."""
        return [*self.plain.get(form, []), *self.made.get(form, [])]

    def fitting(self, form: Form, fits: Fits) -> Iterator[tuple[str, str]]:
        """Text and words of what fits in a place: of one operation, then of two."""
        ones = self.made.get(form, [])
        if ones:
            for k in np.flatnonzero(fits(np.stack([one.value for one in ones]))):
                yield ones[k].text, ones[k].words
        yield from self._of_sums(form, fits)
        if form:
            yield from self._of_multiples(form, fits)
        if len(form) == 1:
            yield from self._projected(form, fits)
        elif form == ():
            yield from self._lengths(fits)
        elif form[0] == form[1]:
            yield from self._chains(form, fits)

    def _of_sums(self, form: Form, fits: Fits) -> Iterator[tuple[str, str]]:
        """Something made with one operation, and another symbol."""
        ones, others = self.all(form), self.plain.get(form, [])
        signs: list[tuple[str, str, Any]] = [("+", "a sum", np.add), ("-", "a difference", np.subtract)]
        if not form:
            signs += [("*", "a product", np.multiply), ("/", "a quotient", np.true_divide)]
        if not ones or not others:
            return
        left, right = np.stack([one.value for one in ones]), np.stack([one.value for one in others])
        for sign, what, operation in signs:
            for turned in (False, True) if sign in "-/" else (False,):
                a, b = (right[None], left[:, None]) if turned else (left[:, None], right[None])
                made = operation(a, b).reshape(-1, *left.shape[1:])
                for k in np.flatnonzero(fits(made)):
                    one, two = ones[k // len(others)].text, others[k % len(others)].text
                    one, two = (two, one) if turned else (one, two)
                    yield f"({one}) {sign} ({two})", f"{what}, made of {_names(one, two)},"

    def _of_multiples(self, form: Form, fits: Fits) -> Iterator[tuple[str, str]]:
        """A vector or a matrix times a number, or divided by one."""
        ones, numbers = self.all(form)[:FACTORS], self.all(())[:FACTORS]
        if not ones or not numbers:
            return
        left = np.stack([one.value for one in ones])
        right = np.stack([one.value for one in numbers])
        right = right.reshape(*right.shape, *(1,) * len(form))
        for sign, what, operation in (("*", "a multiple", np.multiply), ("/", "a multiple", np.true_divide)):
            for start in range(0, len(ones), 40):
                made = operation(left[start : start + 40, None], right[None])
                for k in np.flatnonzero(fits(made.reshape(-1, *left.shape[1:]))):
                    one, two = ones[start + k // len(numbers)].text, numbers[k % len(numbers)].text
                    yield (
                        f"({one}) {sign} ({two})",
                        f"{what} of `{one}`, with a factor made of {_names(two)},",
                    )

    def _projected(self, form: Form, fits: Fits) -> Iterator[tuple[str, str]]:
        """The part of a vector along another, what is left of it, and cross products of differences."""
        ones = [one for one in self.all(form) if "(" not in one.text.strip("()")][:40]
        if not ones:
            return
        left = np.stack([one.value for one in ones])
        along = np.einsum("abk,cbk->acb", left, left)[..., None] * left[None]
        for what, text, made in (
            ("the part along {1} of {0}", "({0}).dot({1}) * ({1})", along),
            ("{0} less its part along {1}", "({0}) - ({0}).dot({1}) * ({1})", left[:, None] - along),
            (
                "the cross product of {0} and {1}",
                "({0}).cross({1})",
                np.cross(left[:, None], left[None]) if form == (3,) else None,
            ),
        ):
            if made is not None:
                for k in np.flatnonzero(fits(made.reshape(-1, *left.shape[1:]))):
                    names = ones[k // len(ones)].text, ones[k % len(ones)].text
                    yield text.format(*names), what.format(*names)

    def _lengths(self, fits: Fits) -> Iterator[tuple[str, str]]:
        """Lengths and dot products of what is made with one operation."""
        for form in [form for form in self.plain if len(form) == 1]:
            ones = self.all(form)[:60]
            left = np.stack([one.value for one in ones])
            products = np.einsum("abk,cbk->acb", left, left)
            squares = products[np.arange(len(ones)), np.arange(len(ones))]
            for k in np.flatnonzero(fits(np.sqrt(squares))):
                yield f"({ones[k].text}).norm()", f"the length of `{ones[k].text}`"
            for k in np.flatnonzero(fits(products.reshape(-1, left.shape[1]))):
                one, two = ones[k // len(ones)].text, ones[k % len(ones)].text
                yield f"({one}).dot({two})", f"a dot product, made of {_names(one, two)},"

    def _chains(self, form: Form, fits: Fits) -> Iterator[tuple[str, str]]:
        """Products of three matrices; the identity less a matrix."""
        ones = self.made.get(form, [])
        plain = [*self.plain.get(form, []), *(one for one in ones if one.text.endswith(".transpose()"))]
        vectors = self.made.get(form[:1], [])
        if vectors:
            diagonals = np.stack([one.value for one in vectors])[..., None] * np.eye(form[0])
            for k in np.flatnonzero(fits(diagonals)):
                yield f"diag({vectors[k].text})", f"the diagonal matrix of {vectors[k].words}"
        if ones:
            stack = np.stack([one.value for one in ones])
            for k in np.flatnonzero(fits(np.eye(form[0]) - stack)):
                text = f"ti.Matrix.identity(float, {form[0]}) - {ones[k].text}"
                yield text, f"the identity less {ones[k].words}"
        named = {one.text for one in plain}
        products = [one for one in self.all(form) if one.text not in named][:FACTORS]
        if not products or not plain:
            return
        left, right = np.stack([one.value for one in products]), np.stack([one.value for one in plain])
        for turned in (False, True):
            made = right[None] @ left[:, None] if turned else left[:, None] @ right[None]
            for k in np.flatnonzero(fits(made.reshape(-1, *left.shape[1:]))):
                one, two = products[k // len(plain)].text, plain[k % len(plain)].text
                one, two = (two, one) if turned else (one, two)
                yield f"({one}) @ ({two})", f"a product of matrices, made of {_names(one, two)},"


def _names(*texts: str) -> str:
    """The symbols of some expressions, in words."""
    called = {*OF_VECTOR, *OF_VECTORS, *OF_MATRIX, "diag", "abs"}
    names = [
        n.id
        for text in texts
        for n in ast.walk(ast.parse(text, mode="eval"))
        if isinstance(n, ast.Name) and n.id not in called
    ]
    *most, last = dict.fromkeys(names)
    return f"{', '.join(most)} and {last}" if most else last


def made(search: Search) -> Iterator[Repair]:
    """What belongs in a place, made of the symbols known there with an operation or two."""
    scope = search.changes.scope
    nodes = [n for n in ast.walk(search.meaning.node) if isinstance(n, ast.expr) and scope.counts(n)]
    places = [
        n for n in nodes if id(n) in search.meaning.here and isinstance(search.slope(n), (Slope, Target))
    ]
    for node in sorted(places, key=lambda n: len(text_of(n)))[:PLACES]:
        form = scope.form(node)
        if form is None or isinstance(node, ast.Constant):
            continue
        fitting = known(search, node).fitting(form, partial(search.fits, node))
        for text, words in itertools.islice(fitting, MOST_MADE):
            new = ast.parse(text, mode="eval").body
            plain = ast.unparse(new)
            shown = f": `{plain}`" if len(plain) <= SHOWN else ""
            said = f"{code(node)} stands where {words} belongs{shown}"
            change = Repair("another", f"made {text}", node.lineno, said, {id(node): new})
            try:
                if search.is_right(change):
                    yield change
            except IMPOSSIBLE:
                continue


def known(search: Search, node: ast.AST) -> Kit:
    """What is made of the symbols that have a name where a node stands, worked out once."""
    symbols = _symbols(search, node)
    key = tuple((name, value.tobytes()) for name, value in symbols.items())
    if key not in search.kits:
        search.kits[key] = Kit(symbols)
    return search.kits[key]


def _symbols(search: Search, node: ast.AST) -> dict[str, np.ndarray]:
    """Numbers, vectors and small matrices that have a name where a node stands."""
    found = {}
    for key, value in search.meaning.here[id(node)].items():
        if key in search.changes.scope.loops or isinstance(value, (list, tuple)):
            continue
        array = np.asarray(value, dtype=np.float64)
        if array.ndim and max(array.shape[1:], default=1) <= SIDE:
            found[key] = np.broadcast_to(array, (search.meaning.count, *array.shape[1:]))[search.few]
    return found
