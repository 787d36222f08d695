"""The slips one can make in a formula: single changes of its syntax tree, and the same change made throughout.

A sign, a factor, an index, a name, the order of a product, a bracket, a guard: see `WORDS`. `Reader` lists the
edits of a function; `applied` makes one.
"""

from muslin.authoring.edits.pieces import applied
from muslin.authoring.edits.reader import Reader
from muslin.authoring.edits.words import WORDS, Change, Edit

__all__ = ["WORDS", "Change", "Edit", "Reader", "applied"]
