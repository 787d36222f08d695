"""Who may have copied from whom: advice for a person to look into, never a verdict.

Submissions are compared as streams of tokens, as MOSS does: Pygments reads them (however broken they are), names
become alike, comments and docstrings go. Runs of tokens are fingerprinted and thinned by winnowing (Schleimer,
Wilkerson & Aiken 2003). What stands in the stubs is nobody's own, and neither is what many have: there are not many
ways to write a right formula, so only what is rare says something. What stands in the published solution is rare
in no class where it goes round: who has nearly all of a file of it is named apart, whoever else has it too.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import combinations

from pygments.lexers.python import PythonLexer
from pygments.token import Comment, Name, Number, String, Text, Whitespace

#: Tokens in a fingerprint, and fingerprints of which the smallest is kept: a copied run of LENGTH + WINDOW - 1
#: tokens is always found.
LENGTH, WINDOW = 10, 5

#: What more of a class than this share has, and more than this many, is common knowledge.
COMMON, AT_LEAST = 0.06, 3

#: A pair is shown if it shares this many rare fingerprints, and this share of those of the smaller.
SHARED, SHARE = 8, 0.3

#: Most pairs that are shown.
MOST = 50

#: A file resembles the published solution's if it has this share of its fingerprints, and the solution this share of
#: the file's; and if there are at least that many, since a short right function looks like any other. Right solutions
#: that were written otherwise have at most 0.35.
PUBLISHED, OWN, ENOUGH = 0.75, 0.6, 25


@dataclass(frozen=True)
class Pair:
    """Two submissions that have rare passages in common.

    `share` is of the rare fingerprints of the smaller one; `files` are where they are, most first.
    """

    first: str
    second: str
    shared: int
    share: float
    files: tuple[str, ...]


@dataclass(frozen=True)
class Alike:
    """What a comparison found: pairs, and which files of whom resemble the published solution (None: not at hand)."""

    pairs: tuple[Pair, ...] = ()
    published: Mapping[str, tuple[str, ...]] | None = None


def compared(
    sources: Mapping[str, Mapping[str, str]], stubs: Mapping[str, str], solution: Mapping[str, str]
) -> Alike:
    """Who resembles whom, and who the published solution.

    Parameters
    ----------
    sources : dict of dict of str
        Files of each submission as text.
    stubs, solution : dict of str
        The files everyone started from, and those of the published solution; empty if it is not at hand.
    """
    given = {mark for text in stubs.values() for mark in fingerprints(text)}
    answers = {file: fingerprints(text) - given for file, text in solution.items()}
    published = {}
    for key in sorted(sources):
        files = [
            file for file in sorted(answers) if _resembles(sources[key].get(file, ""), answers[file], given)
        ]
        if files:
            published[key] = tuple(files)
    common = {**stubs, **{f"solution {file}": text for file, text in solution.items()}}
    return Alike(tuple(pairs(sources, common)), published if solution else None)


def _resembles(text: str, answer: frozenset[int], given: set[int]) -> bool:
    own = fingerprints(text) - given
    both = len(own & answer)
    return len(answer) >= ENOUGH and both >= PUBLISHED * len(answer) and both >= OWN * len(own)


def pairs(sources: Mapping[str, Mapping[str, str]], stubs: Mapping[str, str]) -> list[Pair]:
    """Pairs that someone should look at, the most alike first.

    Parameters
    ----------
    sources : dict of dict of str
        Files of each submission as text.
    stubs : dict of str
        The files everyone started from.
    """
    given = {mark for text in stubs.values() for mark in fingerprints(text)}
    marks: dict[str, dict[int, str]] = {}
    for key, files in sources.items():
        own = {mark: file for file, text in files.items() for mark in fingerprints(text)}
        marks[key] = {mark: file for mark, file in own.items() if mark not in given}
    having = Counter(mark for own in marks.values() for mark in own)
    most = max(AT_LEAST, COMMON * len(sources))
    rare = {key: {m for m in own if having[m] <= most} for key, own in marks.items()}
    holders: dict[int, list[str]] = defaultdict(list)
    for key in sorted(rare):
        for mark in rare[key]:
            if having[mark] > 1:
                holders[mark].append(key)
    shared: dict[tuple[str, str], list[int]] = defaultdict(list)
    for mark, keys in holders.items():
        for pair in combinations(keys, 2):
            shared[pair].append(mark)
    found = []
    for (first, second), common in shared.items():
        share = len(common) / min(len(rare[first]), len(rare[second]))
        if len(common) >= SHARED and share >= SHARE:
            where = Counter(marks[first][mark] for mark in common)
            ordered = sorted(where, key=lambda file: (-where[file], file))
            found.append(Pair(first, second, len(common), round(share, 4), tuple(ordered)))
    return sorted(found, key=lambda p: (-p.share, -p.shared, p.first, p.second))[:MOST]


@lru_cache(4096)
def fingerprints(text: str) -> frozenset[int]:
    """Fingerprints of a file, thinned."""
    stream = list(tokens(text))
    runs = (" ".join(stream[k : k + LENGTH]) for k in range(len(stream) - LENGTH + 1))
    marks = [_mark(run) for run in runs]
    count = max(1, len(marks) - WINDOW + 1) if marks else 0
    return frozenset(min(marks[k : k + WINDOW]) for k in range(count))


def tokens(text: str) -> Iterator[str]:
    """Tokens that carry meaning; names someone has chosen all alike."""
    # the lexer looks for a docstring from every blank line, and takes minutes for some thousand in a row
    text = "\n".join(line.rstrip() for line in text.split("\n") if line and not line.isspace())
    for kind, word in _lexer().get_tokens(text):
        if kind in Comment or kind in Text or kind in Whitespace or kind in String:
            continue
        if kind in Name and kind not in Name.Builtin and kind not in Name.Decorator:
            yield "name"
        elif kind in Number:
            yield word.lower()
        elif word.strip():
            yield word


def _mark(run: str) -> int:
    return int.from_bytes(hashlib.blake2b(run.encode(), digest_size=8).digest(), "big")


@cache
def _lexer() -> PythonLexer:
    return PythonLexer(ensurenl=False)
