"""Who may have copied from whom: advice for a person to look into, never a verdict.

Submissions are compared as streams of tokens, as MOSS does: Pygments reads them (however broken they are), names
become alike, comments and docstrings go. Runs of tokens are fingerprinted and thinned by winnowing (Schleimer,
Wilkerson & Aiken 2003). What stands in the stubs is nobody's own, and neither is what many have: there are not many
ways to write a right formula, so only what is rare says something.
"""

from __future__ import annotations

import hashlib
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
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


def fingerprints(text: str) -> set[int]:
    """Fingerprints of a file, thinned."""
    stream = list(tokens(text))
    runs = (" ".join(stream[k : k + LENGTH]) for k in range(len(stream) - LENGTH + 1))
    marks = [_mark(run) for run in runs]
    return {min(marks[k : k + WINDOW]) for k in range(max(1, len(marks) - WINDOW + 1))} if marks else set()


def tokens(text: str) -> Iterator[str]:
    """Tokens that carry meaning; names someone has chosen all alike."""
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
