"""What passes between grader and worker: frames of one JSON header and raw arrays.

A frame is its length, the length of the header, the header, and the bytes of the arrays one after the other;
the header says their types and shapes. Nothing is ever unpickled. Whatever comes from the worker is hostile:
it is capped before it is read, and parsed into plain data or refused with `Garbled`.
"""

from __future__ import annotations

import json
import math
import socket
import struct
import time
from collections.abc import Mapping
from typing import Any

import numpy as np

#: Largest frame and largest header of one [bytes], longest name of an array.
LARGEST_FRAME, LARGEST_HEADER, LONGEST_NAME = 64_000_000, 200_000, 100

_LENGTHS = struct.Struct("<QI")
_TYPES = ("<f8", "<i4", "|u1", "<i8")


class Garbled(Exception):
    """What came is not a frame."""


class TooLate(Exception):
    """Nothing came in time."""


class Gone(Exception):
    """The other side has closed."""


def send(
    channel: socket.socket,
    header: Mapping[str, Any],
    arrays: Mapping[str, np.ndarray] | None = None,
    deadline: float | None = None,
) -> None:
    """Send a frame.

    Raises
    ------
    Gone
        If the other side has closed.
    TooLate
        If it does not take the frame before `deadline` (of `time.monotonic`).
    """
    packed = {name: np.ascontiguousarray(array) for name, array in (arrays or {}).items()}
    described = [[name, array.dtype.str, list(array.shape)] for name, array in packed.items()]
    head = json.dumps({**header, "arrays": described}).encode()
    body = b"".join(array.tobytes() for array in packed.values())
    try:
        channel.settimeout(None if deadline is None else max(deadline - time.monotonic(), 1e-3))
        channel.sendall(_LENGTHS.pack(len(head) + len(body), len(head)) + head + body)
    except TimeoutError:
        raise TooLate from None
    except OSError:
        raise Gone from None


def receive(
    channel: socket.socket, deadline: float | None = None
) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Receive a frame: its header and its arrays by name.

    Raises
    ------
    Gone, TooLate, Garbled
    """
    total, head_size = _LENGTHS.unpack(_exactly(channel, _LENGTHS.size, deadline))
    if not head_size <= total <= LARGEST_FRAME or head_size > LARGEST_HEADER:
        raise Garbled("its length is out of bounds")
    data = _exactly(channel, total, deadline)
    try:
        header = json.loads(data[:head_size])
        json.dumps(header, ensure_ascii=False).encode()  # no half of a surrogate pair, no file could hold it
        described = header.pop("arrays")
        arrays, start = {}, head_size
        for name, kind, shape in described:
            if not (isinstance(name, str) and len(name) <= LONGEST_NAME and name.isprintable()):
                raise Garbled("an array of no usable name")
            if kind not in _TYPES or not all(type(n) is int and 0 <= n <= 10**7 for n in shape):
                raise Garbled("an array of no known type or shape")
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


def _exactly(channel: socket.socket, size: int, deadline: float | None) -> bytes:
    data = bytearray()
    while len(data) < size:
        try:
            channel.settimeout(None if deadline is None else max(deadline - time.monotonic(), 1e-3))
            piece = channel.recv(min(size - len(data), 1 << 20))
        except TimeoutError:
            raise TooLate from None
        except OSError:
            raise Gone from None
        if not piece:
            raise Gone
        data += piece
        if deadline is not None and time.monotonic() > deadline:
            raise TooLate
    return bytes(data)
