"""Single changes of a student's own function: what each would say is wrong, tried one after the other.

A change that makes every public case right names the mistake, on whatever way the student took: its line, what stands
there, and what kind of slip it is. No formula is needed for it, only what is asked: `muslin.grading.repairing` tries
them on what the text means (`muslin.reading.meaning`), the plainest first.

`pieces` holds what a change is and how it is told, `scope` what there is in a function, `expressions`, `operations`
and `entries` change a symbol or two, `missing` adds a factor or a term or puts another part in place, `statements`
changes a line, and `changes` puts them in order.
"""

from muslin.reading.repairs.changes import Changes
from muslin.reading.repairs.pieces import KINDS, Repair

__all__ = ["KINDS", "Changes", "Repair"]
