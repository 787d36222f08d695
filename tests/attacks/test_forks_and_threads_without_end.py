"""Attack 21: fork bomb, thread bomb.

Defence: no processes at all (filter), a limit for each worker's own user (namespace, uid); the address space
bounds threads everywhere. The bombs here are bounded, for systems without a defence.
"""

import re

from attacking import TARGET, honest, needs

HOSTILE = """
import os, threading, time
made = 0
for _ in range(300):
    try:
        if os.fork() == 0:
            time.sleep(60)
            os._exit(0)
        made += 1
    except OSError:
        break
threads = 0
for _ in range(2000):
    try:
        threading.Thread(target=time.sleep, args=(1e6,), daemon=True).start()
        threads += 1
    except RuntimeError:
        break
print("MADE", made, "processes and", threads, "threads")
"""


def test_bombs_do_not_go_off(attack, level):
    record = attack({TARGET: HOSTILE + honest()}, level=level)
    made, threads = map(
        int, re.findall(r"MADE (\d+) processes and (\d+)", record["sphere_contact"].output)[0]
    )
    needs(record, "process and thread limit")
    assert made < 100
    assert threads < 1000
