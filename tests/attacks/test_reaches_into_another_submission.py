"""Attack 29: reads and writes another student's files while both are graded.

Defence: a root and home of its own for every worker, or rights to nothing else (landlock, another user).
"""

import tempfile
from concurrent.futures import ThreadPoolExecutor

from attacking import BYSTANDER, TARGET, honest, needs, write

SPY = """
import glob, os, time
until = time.monotonic() + 2
seen = set()
while time.monotonic() < until:
    for place in PLACES:
        for path in glob.glob(place + "/**/*.py", recursive=True):
            try:
                if "MINE" not in open(path).read():
                    seen.add(path)
                open(path, "a").write("# spoiled")
            except OSError:
                pass
    time.sleep(0.05)
print("SEEN", sorted(seen))
"""


def test_two_gradings_at_once_see_nothing_of_each_other(attack, level, tmp_path):
    victim = write(tmp_path / "victim", {f: honest(f) for f in (TARGET, BYSTANDER)})
    alone = attack.grade(victim, level=level)
    places = [str(victim), tempfile.gettempdir()]
    with ThreadPoolExecutor(1) as pool:
        other = pool.submit(lambda: [attack.grade(victim, level=level) for _ in range(2)])
        folder = write(tmp_path / "spy", {TARGET: "# MINE" + SPY.replace("PLACES", repr(places)) + honest()})
        record = attack.grade(folder, level=level)
        graded = other.result()
    needs(record, "own user" if level != "process" else "no other processes or programs")
    assert "SEEN []" in record["sphere_contact"].output
    assert all(result == alone[result.name] for one in graded for result in one)
    assert (victim / TARGET).read_text() == honest()
