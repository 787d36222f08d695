"""Results on disk: each in a file of its own, written whole or not at all, and one run at a time."""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from muslin.base import paths, writing
from muslin.base.errors import MuslinError, of_system
from muslin.classes.work import Result
from muslin.grading.record import from_json

SCHEMA = "muslin/class-result/v1"


class Ledger:
    """The results in a report's folder.

    Parameters
    ----------
    folder : Path
        Made if need be.
    """

    def __init__(self, folder: Path):
        self.folder = folder
        self._records = folder / "records"
        with _writing(folder):
            self._records.mkdir(parents=True, exist_ok=True)

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Have this folder to ourselves; the system lets go of it however we end.

        Raises
        ------
        MuslinError
            If another run has it.
        """
        with _writing(self.folder):
            lock = open(self.folder / ".lock", "a+", encoding="utf-8")  # noqa: SIM115
        with lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                lock.seek(0)
                raise MuslinError(
                    f"Another run (process {lock.read(20).strip() or '?'}) is at work on {paths.shown(self.folder)}.",
                    "Wait for it or stop it, or write to another folder with --out.",
                ) from None
            with contextlib.suppress(OSError):  # only to name us to another run; the disk may be full
                lock.truncate(0)
                lock.write(str(os.getpid()))
                lock.flush()
            with _writing(self.folder):
                for unfinished in self.folder.rglob(".*.new"):
                    unfinished.unlink(missing_ok=True)
            yield

    def take(self, key: str, stamp: Mapping[str, str], apart_from: str = "") -> Result | None:
        """The result of an earlier run, if it is whole, final and of the very same work.

        `apart_from` names what of the stamp may differ.
        """
        try:
            data = json.loads((self._records / f"{key}.json").read_bytes())
            kept = {name: value for name, value in data["stamp"].items() if name != apart_from}
            if data["schema"] != SCHEMA or kept != {n: v for n, v in stamp.items() if n != apart_from}:
                return None
            result = Result(**data["result"])
            if result.record is not None:
                from_json(result.record)
            return result if result.key == key and result.final else None
        except (OSError, ValueError, KeyError, TypeError, AttributeError):
            return None

    def keep(self, result: Result, stamp: Mapping[str, str]) -> None:
        """Write a result, and note in the journal that it was worked for."""
        data = {"schema": SCHEMA, "stamp": stamp, "result": asdict(result)}
        write(self._records / f"{result.key}.json", json.dumps(data).encode())
        line = json.dumps({"key": result.key, "cpu": result.cpu, "graded": result.record is not None})
        with _writing(self.folder), open(self.folder / "journal.jsonl", "ab") as journal:
            journal.write(line.encode() + b"\n")
            journal.flush()
            os.fsync(journal.fileno())

    def journal(self) -> list[dict[str, Any]]:
        """Every grading that has been done for this report, in order."""
        entries = []
        with contextlib.suppress(OSError):
            for line in (self.folder / "journal.jsonl").read_text(encoding="utf-8").splitlines():
                with contextlib.suppress(ValueError):
                    entries.append(json.loads(line))
        return entries


@contextlib.contextmanager
def _writing(path: Path) -> Iterator[None]:
    """What the system says against writing somewhere, for people."""
    try:
        yield
    except OSError as error:
        why = error.strerror or error
        raise MuslinError(f"{paths.shown(path)} cannot be written: {why}.", of_system(error).hint) from None


def write(path: Path, data: bytes) -> None:
    """Write a file of a class, whole or not at all, that its instructor alone may read."""
    writing.write(path, data, private=True)
