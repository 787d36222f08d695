"""Beyond the table: a worker that has seen hidden inputs tells another, by anything that two processes share.

Locks and watches on library files that all may read, futexes on their pages, what of them is in memory, keys,
queues and segments of the kernel; nothing is made here that stays. Defence: a list of system calls without any of
these (filter).
"""

import platform

import pytest
from attacking import TARGET, honest, needs

HOSTILE = """
import ctypes, errno, fcntl, mmap, os, struct
libc = ctypes.CDLL(None, use_errno=True)
libc.mmap.restype = ctypes.c_void_p
open_ways, other = [], os.getppid() or 2
open("mine", "w").close()
library = os.open(os.__file__, os.O_RDONLY)
page = ctypes.c_void_p(libc.mmap(None, ctypes.c_size_t(4096), 1, 1, library, ctypes.c_long(0)))
def way(name, *call):
    if getattr(libc, call[0])(*call[1:]) != -1 or ctypes.get_errno() not in (errno.EPERM, errno.ENOSYS):
        open_ways.append(name)
def number(name, n, *call):
    way(name, "syscall", ctypes.c_long(n), *call)
for name, how in (
    ("flock", lambda: fcntl.flock(library, fcntl.LOCK_SH | fcntl.LOCK_NB)),
    ("lockf", lambda: fcntl.lockf(library, fcntl.LOCK_SH | fcntl.LOCK_NB)),
    ("open file description lock", lambda: fcntl.fcntl(library, 37, struct.pack("hhqqi4x", 0, 0, 0, 0, 0))),
    ("is it locked", lambda: fcntl.fcntl(library, 36, struct.pack("hhqqi4x", 0, 0, 0, 0, 0))),
    ("lease", lambda: fcntl.fcntl(library, 1024, 0)),
    ("advice", lambda: os.posix_fadvise(library, 0, 4096, 4)),
    ("attribute", lambda: os.setxattr(library, "told", b"1")),
    ("times", lambda: os.utime(library, ns=(os.fstat(library).st_atime_ns, os.fstat(library).st_mtime_ns))),
    ("emptying by its name", lambda: os.truncate(os.__file__ + ".not there", 0)),
    ("emptying what may only be read", lambda: os.open("mine", os.O_RDONLY | os.O_TRUNC)),
    ("read ahead at once", lambda: os.preadv(library, [bytearray(8)], 0, 8)),
):
    try:
        how()
    except OSError as error:
        if error.errno in (errno.EPERM, errno.ENOSYS):
            continue
    except AttributeError:
        continue
    open_ways.append(name)
number("waking on a page of a library", 202, page, 1, 1, None, None, 0)
number("moving who waits there", 202, page, 3, 1, ctypes.c_long(1), page, 0)
number("waking, the new way", 454, page, 1, 1, 2)
number("which thread is told when this ends", 218, page)
number("pages in memory", 27, page, ctypes.c_size_t(4096), ctypes.create_string_buffer(8))
number("pages in memory, the new way", 451, library, None, None, 0)
number("watch on files", 253)
number("watch on the disk", 300, 0, 0)
number("segment", 29, 4711, ctypes.c_size_t(4096), 0)
number("semaphore", 64, 4711, 1, 0)
number("queue", 68, 4711, 0)
number("named queue", 240, b"muslin", 0, 0, None)
number("key", 248, b"user", b"muslin", b"1", 1, -2)
number("keys of this user", 250, 0, -4, 0)
number("asking for a key", 249, b"user", b"muslin", None, 0)
number("priority", 141, 0, 0, 5)
number("cores", 203, 0, 8, struct.pack("Q", 1))
number("disk priority", 251, 1, 0, 0)
number("another's memory", 310, other, None, 0, None, 0, 0)
number("another's descriptors", 438, 0, 0, 0)
number("another's number", 434, other, 0)
number("another's limits", 302, other, 7, None, ctypes.create_string_buffer(16))
number("waiting on all cores", 324, 1, 0)
number("comparing processes", 312, other, other, 0, 0, 0)
number("rings", 425, 4, ctypes.create_string_buffer(256))
number("requests", 206, 4, ctypes.byref(ctypes.c_long(0)))
number("counters", 298, ctypes.create_string_buffer(128), 0, -1, -1, 0)
number("programs in the kernel", 321, 0, ctypes.create_string_buffer(128), 128)
number("page faults", 323, 0)
number("personality", 135, 0xFFFFFFFF)
number("user space", 272, 0x10000000)
print("WAYS", open_ways)
"""


@pytest.mark.skipif(platform.machine() != "x86_64", reason="its numbers of system calls are those of x86-64")
def test_no_way_between_workers_is_open(attack, level):
    record = attack({TARGET: HOSTILE + honest()}, level=level)
    needs(record, "nothing shared between workers")
    assert "WAYS []" in record["sphere_contact"].output
    assert record["sphere_contact"].status == "passed"
