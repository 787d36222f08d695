"""Attack 26: plants kernels in Taichi's offline cache for the students graded after.

Defence: every worker has a cache of its own; what is kept is kept by the submission's bytes.
"""

import os
from pathlib import Path

from attacking import TARGET, honest

from muslin.grading.kernels import Store

HOSTILE = """
import os, pathlib
for home in (os.path.expanduser("~"), HOME, "kernels"):
    for folder in (".cache/taichi/ticache", ".cache/quadrants/qdcache/kernel_compilation_manager", ".",
                   "kernel_compilation_manager", "muslin/grading", ".cache/muslin/grading"):
        if home == "kernels" and "/" in folder:
            continue  # so deep in there, and nothing would be kept at all
        try:
            target = pathlib.Path(home, folder)
            target.mkdir(parents=True, exist_ok=True)
            for name in ("ticache.tcb", "qdcache.qdb", "T0000.tic", "T0000.qdc", "TOKEN.tic", "../../TOKEN.tic"):
                (target / name).write_bytes(b"TOKEN poison")
        except OSError:
            pass
for kept in pathlib.Path("kernels").rglob("*"):  # what its own earlier grading has compiled
    if kept.is_file():
        kept.write_bytes(b"TOKEN poison")
"""


def test_nobody_else_meets_what_was_planted(attack):
    hostile = HOSTILE.replace("HOME", repr(str(Path.home()))).replace("TOKEN", attack.token)
    record = attack({TARGET: hostile + honest()})
    assert record["sphere_contact"].status == "passed"
    again = attack({TARGET: hostile + honest()})  # its own kept kernels are poisoned now: only it meets them
    assert again["sphere_contact"].status in ("passed", "error")
    other = attack({TARGET: honest() + "# somebody else"})
    assert other.score == record.score
    cache = Path(os.environ["XDG_CACHE_HOME"]) / "muslin" / "grading"
    planted = f"{attack.token} poison".encode()
    own = cache / Store(record.submission.sha256)._folder.name
    kept = [path for path in cache.rglob("*") if path.is_file() and planted in path.read_bytes()]
    assert all(own in path.parents for path in kept)
    for folder in (".cache/taichi", ".cache/quadrants", ".cache/muslin"):
        assert not list((Path.home() / folder).rglob(f"{attack.token}*"))
