"""What passes between grader and worker: frames of one JSON header and raw arrays.

A frame is its length, the length of the header, the header, and the bytes of the arrays one after the other;
the header says their types and shapes. Nothing is ever unpickled. Whatever comes from the worker is hostile:
it is capped before it is read, and parsed into plain data or refused with `Garbled`: how deep the header is
nested, and how many arrays of which types and shapes there are, must be as expected.
"""

from __future__ import annotations

import json
import math
import socket
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from muslin.grading.patience import Patience, TooLate

__all__ = ["Form", "Garbled", "Gone", "TooLate", "receive", "send"]

#: Largest frame and largest header of one [bytes], longest name of an array.
LARGEST_FRAME, LARGEST_HEADER, LONGEST_NAME = 64_000_000, 200_000, 200

#: How deep a header may be nested, how many axes an array may have.
DEEPEST, MOST_AXES = 8, 4

_LENGTHS = struct.Struct("<QI")
_TYPES = ("<f8", "<i4", "|u1", "<i8")

#: Type and shape of an array.
Form = tuple[str, tuple[int, ...]]


class Garbled(Exception):
    """What came is not a frame."""


class Gone(Exception):
    """The other side has closed."""


def send(
    channel: socket.socket,
    header: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray] | None = None,
    patience: Patience | None = None,
) -> None:
    """Send a frame.

    Raises
    ------
    Gone
        If the other side has closed.
    TooLate
        If it does not take the frame while there is `patience`; without it is waited for.
    """
    packed = {name: np.ascontiguousarray(array) for name, array in (arrays or {}).items()}
    described = [[name, array.dtype.str, list(array.shape)] for name, array in packed.items()]
    head = json.dumps({**header, "arrays": described}).encode()
    body = b"".join(array.tobytes() for array in packed.values())
    rest = memoryview(_LENGTHS.pack(len(head) + len(body), len(head)) + head + body)
    try:
        if patience is None:
            channel.sendall(rest)
            return
        while rest:
            patience.wait(channel, writing=True)
            try:
                rest = rest[channel.send(rest, socket.MSG_DONTWAIT) :]
            except BlockingIOError:
                continue
    except OSError:
        raise Gone from None


def receive(
    channel: socket.socket,
    patience: Patience | None = None,
    expected: Mapping[str, Form] | None = None,
    calls: bool = False,
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Receive a frame: its header and its arrays by name.

    Parameters
    ----------
    channel : socket
    patience : Patience, optional
        Without it is waited for.
    expected : dict of (type, shape), optional
        The arrays that must be there, no more and no others; a header that tells of an "error" comes without.
    calls : bool
        Whether a header that tells of a "call" may come instead, with arrays of its own.

    Raises
    ------
    Gone, TooLate, Garbled
    """
    total, head_size = _LENGTHS.unpack(_exactly(channel, _LENGTHS.size, patience))
    if not head_size <= total <= LARGEST_FRAME or head_size > LARGEST_HEADER:
        raise Garbled("its length is out of bounds")
    data = _exactly(channel, total, patience)
    try:
        header = json.loads(data[:head_size])
        if _depth(header) > DEEPEST:
            raise Garbled("its header is nested too deep")
        json.dumps(header, ensure_ascii=False).encode()  # no half of a surrogate pair, no file could hold it
        described = header.pop("arrays")
        forms = {name: _form(name, kind, shape) for name, kind, shape in described}
        any_may = expected is None or (calls and "call" in header)
        wanted = forms if any_may else dict(expected or {}) if header.get("error") is None else {}
        if len(forms) != len(described) or forms != wanted:
            raise Garbled("other arrays than were asked for")
        arrays, start = {}, head_size
        for name, (kind, shape) in forms.items():
            size = np.dtype(kind).itemsize * math.prod(shape)
            if start + size > total:
                raise Garbled("an array longer than its frame")
            arrays[name] = np.frombuffer(data[start : start + size], dtype=kind).reshape(shape).copy()
            start += size
    except Garbled:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, MemoryError):
        raise Garbled("its header cannot be read") from None
    return header, arrays


def _depth(value: Any) -> int:
    """How deep lists and objects are nested in a value; without recursion, which has an end of its own."""
    depth, level = 0, [value]
    while level := [
        entry
        for outer in level
        if isinstance(outer, (list, dict))
        for entry in [None, *(outer.values() if isinstance(outer, dict) else outer)]
    ]:
        depth += 1
    return depth


def _form(name: Any, kind: Any, shape: Any) -> Form:
    """What a header says of an array, if an array can be so."""
    if not (isinstance(name, str) and len(name) <= LONGEST_NAME and name.isprintable()):
        raise Garbled("an array of no usable name")
    known = kind in _TYPES and isinstance(shape, list) and len(shape) <= MOST_AXES
    if not known or not all(type(n) is int and 0 <= n <= 10**7 for n in shape):
        raise Garbled("an array of no known type or shape")
    return kind, tuple(shape)


def _exactly(channel: socket.socket, size: int, patience: Patience | None) -> bytes:
    data = bytearray()
    while len(data) < size:
        if patience is not None:
            patience.wait(channel)
        try:
            piece = channel.recv(min(size - len(data), 1 << 20))
        except OSError:
            raise Gone from None
        if not piece:
            raise Gone
        data += piece
    return bytes(data)
