"""All changes of a function, in order: single ones, the same made throughout, two names exchanged."""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Callable, Iterator, Mapping

from muslin.reading.meaning import Meaning
from muslin.reading.repairs import alike, expressions, missing, statements
from muslin.reading.repairs import order as lines
from muslin.reading.repairs.pieces import BORN, KINDS, Repair, code, name, terms, text_of
from muslin.reading.repairs.scope import Scope

#: Of changes of a kind that come to the same, what is said sooner or later: a transpose too many is there to be seen.
SOONER = {
    "no transpose": -1,
    "no inverse": -1,
    "augmented": 1,
    "no normalized": 1,
    "rows->cols": 1,
    "cols->rows": 1,
}

#: Where kinds of changes begin that are less plain than those of a symbol or two, in one place.
LESS_PLAIN = KINDS.index("loop")


#: Changes of conditions of which there are few: two indices exchanged, a condition more or less.
FEW = re.compile("<->|^(and|or|no) |^(and|or)->")


#: A name in place of a zero.
ZERO = re.compile(r"0(\.0)?->")


def _rank(repair: Repair) -> tuple[float, int, int]:
    """How plain a change is: one in one place before one in several, a number for a number before a name for it."""
    kind = -1.0 if repair.detail == BORN else float(KINDS.index(repair.kind))
    if repair.detail.startswith("target "):
        kind = KINDS.index("another")  # a name read is taken for another sooner than a name written
    elif repair.kind == "condition" and FEW.search(repair.detail):
        kind = KINDS.index("operation") + 0.5
    elif repair.kind == "index" and "<->" in repair.detail and "[" not in repair.detail:
        kind += 0.5  # two indices of loops, exchanged in one place
    elif len(repair.changes) > 1 and repair.kind != "condition":
        kind += LESS_PLAIN
    elif repair.detail.startswith("once, never read"):
        kind = -0.5
    elif repair.detail.startswith("once, "):
        kind = KINDS.index("lacks term")  # what a line is for that is no sum is told sooner
    elif repair.kind == "loop" and repair.detail not in ("=->-=", BORN):  # there are few of them
        kind = KINDS.index("operation") + 0.5
    elif repair.kind == "name" and ZERO.match(repair.detail):
        kind = KINDS.index("another") + 0.5  # what else gets a value is looked at sooner
    elif repair.kind == "name" and not repair.detail[:1].isalpha():
        kind = KINDS.index("number") + 0.5
    return kind, SOONER.get(repair.detail, 0), len(repair.changes)


class Changes:
    """All single changes of a function that has been worked out.

    Parameters
    ----------
    meaning : Meaning
    helpers : list of ast.FunctionDef
        Functions of the file that it uses.
    called : dict
        What its own variables are, where that is known.
    """

    def __init__(self, meaning: Meaning, helpers: list[ast.FunctionDef], called: Mapping[str, str]) -> None:
        self.scope = Scope(meaning, helpers, called)

    def plain(self) -> list[Repair]:
        """Those of a symbol or two, the plainest first."""
        singles = list(self._singles())
        return sorted([*singles, *self._together(singles), *self._swaps()], key=_rank)

    def larger(self, hope: Callable[[ast.AST], int]) -> Iterator[Repair]:
        """Factors and terms that are missing, and other parts in place of what stands there.

        Parameters
        ----------
        hope : callable
            0 of a node in whose place no value makes the function right; the higher, the sooner it is looked at.
        """
        scope = self.scope
        nodes = self.valued()
        hopes = {id(node): hope(node) for node in nodes}
        first, ways = (
            (missing.entries, missing.units),
            (
                missing.inserted,
                missing.factors,
                alike.changes,
                missing.addends,
                missing.others,
                missing.counterparts,
            ),
        )
        small = sorted(nodes, key=lambda node: len(text_of(node)))
        levels = sorted(set(hopes.values()) - {0}, reverse=True)
        order = [(level, made) for made in first for level in levels]
        for level, made in [*order, *itertools.product(levels, ways)]:
            for node in small if made is missing.units else nodes:
                if hopes[id(node)] == level:
                    for kind, detail, words, new in made(scope, node, scope.form(node) or ()):
                        yield Repair(kind, detail, node.lineno, words, {id(node): new})
        for statement in ast.walk(scope.meaning.node):
            if isinstance(statement, ast.Assign):
                yield from statements.counterparts(scope, statement)
        yield from lines.changes(scope)

    def unused(self) -> Iterator[Repair]:
        """What is likely and of which there is little: what stands nowhere, what a number beside vectors needs."""
        for statement in (s for f in self.scope.functions for s in ast.walk(f) if isinstance(s, ast.stmt)):
            for kind, detail, words, new in missing.into_a_vector(self.scope, statement):
                yield Repair(kind, detail, statement.lineno, words, {id(statement): new})
        for node in self.valued():
            for made in (missing.broadcast, missing.unused):
                for kind, detail, words, new in made(self.scope, node):
                    yield Repair(kind, detail, node.lineno, words, {id(node): new})

    def valued(self) -> list[ast.expr]:
        """Expressions that come to something else than yes or no."""
        scope = self.scope
        return [
            node
            for function in scope.functions
            for node in ast.walk(function)
            if isinstance(node, ast.expr)
            and scope.counts(node)
            and scope.form(node) is not None
            and not isinstance(node, (ast.Compare, ast.BoolOp))
        ]

    def _singles(self) -> Iterator[Repair]:
        for function in self.scope.functions:
            for node in ast.walk(function):
                if isinstance(node, ast.stmt):
                    yield from statements.changes(self.scope, node)
                elif isinstance(node, ast.expr) and self.scope.counts(node):
                    for kind, detail, words, new in expressions.changes(self.scope, node):
                        yield Repair(kind, detail, node.lineno, words, {id(node): new})

    def _together(self, singles: list[Repair]) -> Iterator[Repair]:
        """The same change made in a whole statement, or in the whole function."""
        groups: dict[tuple[object, ...], list[Repair]] = {}
        for repair in singles:
            if repair.kind not in ("another", "entries"):
                statement = self.scope.meaning.statement.get(next(iter(repair.changes)), -1)
                groups.setdefault((repair.kind, repair.detail), []).append(repair)
                groups.setdefault((repair.kind, repair.detail, statement), []).append(repair)
        seen: set[tuple[str, frozenset[int]]] = set()
        for group in groups.values():
            made = {key: new for repair in group for key, new in repair.changes.items()}
            same = (group[0].detail, frozenset(made))
            if len(group) > 1 and len(made) > 1 and same not in seen:
                seen.add(same)
                lines = sorted({repair.line for repair in group})
                also = ", throughout the line"
                if len(lines) > 1:
                    also = f", and so in line{'s' if len(lines) > 2 else ''} {', '.join(map(str, lines[1:]))}"
                yield Repair(group[0].kind, group[0].detail, lines[0], group[0].words + also, made)

    def _scopes(self) -> Iterator[tuple[str, ast.AST]]:
        """Where two things may be exchanged: the function, a statement, an entry, a term of a sum."""
        yield "", self.scope.meaning.node
        for node in ast.walk(self.scope.meaning.node):
            if isinstance(node, ast.If):
                yield f" in the condition {code(node.test)}", node.test
            if not isinstance(node, (ast.Assign, ast.AugAssign, ast.Return)) or node.value is None:
                continue
            yield f" in {code(node.value)}", node
            lists = [n for n in ast.walk(node.value) if isinstance(n, (ast.List, ast.Tuple))]
            entries = [e for n in lists for e in n.elts if not isinstance(e, (ast.List, ast.Tuple))]
            for whole in (node.value, *entries):
                parts = [term for _, term in terms(whole)]
                for part in ([] if whole is node.value else [whole]) + (parts if len(parts) > 1 else []):
                    yield f" in {code(part)}", part

    def _swaps(self) -> Iterator[Repair]:
        """Two names, or two entries of one array, exchanged."""
        scope, variables = self.scope, self.scope.variables
        for where, part in self._scopes():
            loads = [n for n in ast.walk(part) if isinstance(getattr(n, "ctx", None), ast.Load)]
            tested = where.startswith(" in the condition")
            names = [
                n
                for n in loads
                if isinstance(n, ast.Name) and n.id in variables and (where or n.id not in scope.loops)
            ]
            for a, b in itertools.combinations(dict.fromkeys(n.id for n in names), 2):
                if variables[a] == variables[b] and not _difference(getattr(part, "value", part)):
                    those = [n for n in names if n.id in (a, b)]
                    made: dict[int, ast.AST] = {id(n): name(b if n.id == a else a) for n in those}
                    words = f"{scope.said(a)} and {scope.said(b)} are exchanged{where}"
                    counting = a in scope.loops and b in scope.loops
                    yield Repair(
                        "condition" if tested else "index" if counting else "name",
                        f"{a}<->{b}",
                        min(n.lineno for n in those),
                        words,
                        made,
                    )
            entries: dict[str, list[ast.Subscript]] = {}
            for node in loads:
                if isinstance(node, ast.Subscript):
                    entries.setdefault(ast.unparse(node), []).append(node)
            for (one, first), (two, second) in itertools.combinations(entries.items(), 2):
                if one.split("[")[0] == two.split("[")[0]:
                    p, q = scope.alias(first[0]), scope.alias(second[0])
                    made = {**dict.fromkeys(map(id, first), q), **dict.fromkeys(map(id, second), p)}
                    yield Repair(
                        "index",
                        f"{one}<->{two}",
                        first[0].lineno,
                        f"{one} and {two} are exchanged{where}",
                        made,
                    )


def _difference(node: ast.AST) -> bool:
    """Whether a node is one name minus another: that the two are exchanged is told as a difference turned round."""
    return isinstance(node, ast.BinOp) and all(isinstance(side, ast.Name) for side in (node.left, node.right))
