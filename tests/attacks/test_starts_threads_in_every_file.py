"""Beyond the table: threads in every file, each within the limit of its user, together more than a machine gives.

Defence: no thread at all once Taichi has started its own (filter); a limit for each worker's own user.
"""

import re

from attacking import FILES, TASKS, honest, needs

HOSTILE = """
import threading, time
started = 0
for _ in range(90):
    try:
        threading.Thread(target=time.sleep, args=(3,), daemon=True).start()
        started += 1
    except RuntimeError:
        break
print("STARTED", started)
"""


def test_threads_of_all_files_together_are_few(attack, level):
    record = attack({file: HOSTILE + honest(file) for file in FILES}, spoils=tuple(TASKS), level=level)
    needs(record, "process and thread limit")
    started = [int(n) for task in record for n in re.findall(r"STARTED (\d+)", task.output)]
    assert len(started) == len(FILES)
    assert sum(started) < 10 * len(FILES)
    assert all(task.status == "passed" for task in record)
