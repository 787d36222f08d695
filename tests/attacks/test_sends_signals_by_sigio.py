"""Beyond the table: has the kernel send SIGIO or SIGURG, which kill by default, to the grader.

`fcntl` and `ioctl` make another process the owner of a socket; whatever comes in then signals that one. Its number
is found through the socket. Defence: a list of what may be asked of a descriptor (filter), landlock's scopes, and
a process space in which the grader has no number (namespace).
"""

import signal
import threading

from attacking import TARGET, honest, needs

HOSTILE = """
import array, fcntl, os, socket, struct
armed, target = [], os.getppid()
for number in range(3, 64):
    try:
        end = socket.socket(fileno=os.dup(number))
    except OSError:
        continue
    try:
        target = struct.unpack("3i", end.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))[0]
    except OSError:
        pass
    end.detach()
for number in range(64):
    for what, ask in (
        ("FIOSETOWN", lambda: fcntl.ioctl(number, 0x8901, struct.pack("i", target))),
        ("SIOCSPGRP", lambda: fcntl.ioctl(number, 0x8902, struct.pack("i", target))),
        ("FIOASYNC", lambda: fcntl.ioctl(number, 0x5452, struct.pack("i", 1))),
        ("O_ASYNC", lambda: fcntl.fcntl(number, fcntl.F_SETFL, os.O_ASYNC)),
        ("F_SETOWN", lambda: fcntl.fcntl(number, fcntl.F_SETOWN, target)),
        ("F_SETOWN_EX", lambda: fcntl.fcntl(number, 15, struct.pack("ii", 1, target))),
        ("F_SETSIG", lambda: fcntl.fcntl(number, 10, 29)),
        ("F_NOTIFY", lambda: fcntl.fcntl(number, 1026, 1)),
        ("F_SETLEASE", lambda: fcntl.fcntl(number, 1024, 0)),
    ):
        try:
            ask()
            armed.append(f"{what} of {number}")
        except OSError:
            pass
print("ARMED", armed)
"""


def test_the_kernel_sends_no_signal_for_a_worker(attack, level):
    caught = []
    assert threading.current_thread() is threading.main_thread()
    before = {each: signal.signal(each, lambda number, _: caught.append(number)) for each in SIGNALS}
    try:
        record = attack({TARGET: HOSTILE + honest()}, level=level)
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)
    assert not caught
    needs(record, "no signals to others")
    assert "ARMED []" in record["sphere_contact"].output
    assert record["sphere_contact"].status == "passed"


SIGNALS = (signal.SIGIO, signal.SIGURG)
