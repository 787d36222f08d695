"""Beyond the table: memory that a limit of the address space does not count: files of memfd_create, shared
segments, files in /dev/shm, large pipes. Bounded to half a gigabyte here, for systems without a defence.

Defence: none of these can be made (filter), and the disk in memory is small (namespace).
"""

import re

from attacking import TARGET, honest, needs

HOSTILE = """
import ctypes, fcntl, os
libc = ctypes.CDLL(None, use_errno=True)
held, kept = {}, []
def hold(kind, make):
    for _ in range(8):
        try:
            got = make()
        except (OSError, AttributeError):
            return
        held[kind] = held.get(kind, 0) + got
def of_file(descriptor):
    kept.append(descriptor)
    os.posix_fallocate(descriptor, 0, 60 << 20)
    return 60
def memfd():
    return of_file(os.memfd_create("hidden"))
def secret():
    descriptor = libc.syscall(447, 0)
    if descriptor < 0:
        raise OSError
    return of_file(descriptor)
def shared():
    path = f"/dev/shm/TOKEN-{len(kept)}"
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT)
    os.unlink(path)
    return of_file(descriptor)
def segment():
    number = libc.shmget(0, ctypes.c_size_t(60 << 20), 0o1600)
    if number < 0:
        raise OSError
    libc.shmctl(number, 0, None)
    return 60
def pipes():
    reads, writes = os.pipe()
    kept.extend((reads, writes))
    return fcntl.fcntl(writes, 1031, 1 << 20) >> 20
for kind, make in (("memfd", memfd), ("secret", secret), ("shm", shared), ("segment", segment), ("pipes", pipes)):
    hold(kind, make)
for descriptor in kept:
    os.close(descriptor)
print("HELD", sum(held.values()), "MB", held)
"""


def test_no_memory_is_hidden_from_the_limit(attack, level):
    record = attack({TARGET: HOSTILE.replace("TOKEN", attack.token) + honest()}, level=level)
    needs(record, "memory limit")
    held = re.search(r"HELD (\d+) MB", record["sphere_contact"].output)
    assert held
    assert int(held[1]) == 0
    assert record["sphere_contact"].status == "passed"
