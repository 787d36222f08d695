"""Attack 6: takes over the worker's channel and answers with pickles, object arrays and nonsense.

Defence: frames of raw numbers with caps; nothing is ever unpickled; what is no frame costs the task it
answers.
"""

import json
import socket
import struct

import pytest
from attacking import TARGET, honest

from muslin.grading import wire
from muslin.grading.patience import Patience

HOSTILE = """
import gc, io, os, pickle, socket, struct, json, threading, numpy as np

class Bomb:
    def __reduce__(self):
        return os.system, ("touch /tmp/{token}",)

stream = io.BytesIO()
np.save(stream, np.array([Bomb()], dtype=object), allow_pickle=True)
payload = [pickle.dumps(Bomb()), stream.getvalue(), {frame}][{which}]
channel = next(o for o in gc.get_objects() if isinstance(o, socket.socket))

@ti.func
def never(): pass

def send(*args, **kwargs):
    channel.sendall(payload)
    os._exit(0)

import muslin.grading.wire as wire
wire.send = send
"""


def frame(header, body=b""):
    head = json.dumps(header).encode()
    return struct.pack("<QI", len(head) + len(body), len(head)) + head + body


FRAMES = {
    "an object array": frame({"id": 0, "arrays": [["0", "|O", [1]]]}, b"12345678"),
    "a subarray type": frame({"id": 0, "arrays": [["0", "(3,)<f8", [1]]]}, bytes(24)),
    "a negative shape": frame({"id": 0, "arrays": [["0", "<f8", [-1]]]}),
    "a shape of floats": frame({"id": 0, "arrays": [["0", "<f8", [1e300]]]}),
    "a huge shape": frame({"id": 0, "arrays": [["0", "<f8", [10**7] * 9]]}),
    "a name nobody can write": frame({"id": 0, "arrays": [["\ud800", "<f8", [0]]]}),
    "half a surrogate pair": frame({"id": 0, "error": ["python", "\ud800"], "arrays": []}),
    "too many axes": frame({"id": 0, "arrays": [["0", "<f8", [1] * 40]]}, bytes(8)),
    "one name twice": frame({"id": 0, "arrays": [["0", "<f8", [1]]] * 2}, bytes(16)),
    "a header nested as deep as can be read": frame(
        {"id": 0, "arrays": [], "x": json.loads("[" * 700 + "]" * 700)}
    ),
    "a list": frame([1, 2]),
    "a number of many digits": struct.pack("<QI", 9999, 9999) + b"9" * 9999,
    "deep lists": struct.pack("<QI", 90000, 90000) + b"[" * 90000,
    "a frame of 2**63 bytes": struct.pack("<QI", 1 << 63, 10),
    "a header longer than its frame": struct.pack("<QI", 10, 1 << 31),
}


@pytest.mark.parametrize("which", ["a pickle", "an object array", "a frame"])
def test_nothing_is_unpickled(attack, which):
    number = ["a pickle", "an object array", "a frame"].index(which)
    hostile = HOSTILE.replace("{token}", attack.token).replace("{which}", str(number))
    record = attack(
        {TARGET: "import taichi as ti\n" + hostile.replace("{frame}", repr(FRAMES["a list"])) + honest()}
    )
    assert record["sphere_contact"].score == 0


@pytest.mark.parametrize("data", FRAMES.values(), ids=FRAMES.keys())
def test_hostile_frames_are_refused(data):
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(data)
        with pytest.raises(wire.Garbled):
            wire.receive(ours, Patience(5))
