"""Beyond the table: a socketpair is no network, but its ends can send to sockets of this machine.

Defence: no sockets of any kind, and none sends to an address (filter); abstract names of its own (namespace), or
none outside (landlock).
"""

import os
import socket
import tempfile

from attacking import TARGET, honest, needs

HOSTILE = """
import ctypes, os, socket
reached = []
libc = ctypes.CDLL(None, use_errno=True)
for address in ("\\0TOKEN", "PATH"):
    for kind in (socket.SOCK_DGRAM, socket.SOCK_STREAM, socket.SOCK_SEQPACKET):
        try:
            one, other = socket.socketpair(socket.AF_UNIX, kind)
        except OSError:
            continue
        for how in (lambda: one.sendto(b"hello", address), lambda: one.sendmsg([b"hello"], [], 0, address),
                    lambda: one.connect(address)):
            try:
                how()
                reached.append((kind.name, address))
            except OSError:
                pass
    packed = b"\\x01\\x00" + address.encode() + b"\\0" * (not address.startswith("\\0"))
    for number in range(64):  # the sockets it was given
        if libc.sendto(number, b"", 0, 0x40, packed, len(packed)) >= 0:
            reached.append((number, address))
print("REACHED", reached)
"""


def test_no_socket_of_this_machine_is_reached(attack, level):
    path = os.path.join(tempfile.gettempdir(), "listener")
    with (
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as named,
        socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as abstract,
    ):
        named.bind(path)
        os.chmod(path, 0o777)
        abstract.bind("\0" + attack.token)
        for listener in (named, abstract):
            listener.setblocking(False)
        hostile = HOSTILE.replace("TOKEN", attack.token).replace("PATH", path)
        record = attack({TARGET: hostile + honest()}, level=level)
        heard = [listener for listener in (named, abstract) if _heard(listener)]
        os.unlink(path)
    needs(record, "no network")
    assert not heard
    assert "REACHED []" in record["sphere_contact"].output
    assert record["sphere_contact"].status == "passed"


def _heard(listener):
    try:
        return listener.recv(100)
    except BlockingIOError:
        return b""
