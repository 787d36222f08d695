"""Beyond the table: empty files without end. They have no size, but cost a disk its inodes and memory a kilobyte.

Defence: a disk in memory with a number of inodes (namespace); elsewhere the fork server looks at the homes, and
kills whose is too full.
"""

import re

from attacking import TARGET, honest

from muslin.grading import isolation

HOSTILE = """
import os, time
made, until = 0, time.monotonic() + 10
try:
    while made < 40_000 and time.monotonic() < until:
        os.close(os.open(f"empty{made}", os.O_CREAT | os.O_WRONLY))
        made += 1
    time.sleep(max(0, until - time.monotonic()))
except OSError:
    pass
print("MADE", made)
"""


def test_files_are_limited_in_number(attack, level):
    record = attack({TARGET: HOSTILE + honest()}, level=level)
    result = record["sphere_contact"]
    if level == "namespace":
        made = re.search(r"MADE (\d+)", result.output)
        assert made
        assert int(made[1]) < isolation.FILES
        assert result.status == "passed"
    else:
        assert "MADE" not in result.output
        assert result.status == "error"
        assert "too many files" in result.checks[0].message
