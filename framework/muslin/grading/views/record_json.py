"""The record itself, as strict JSON in pure ASCII: `muslin.grading.record.from_json` reads it back."""

from __future__ import annotations

import json
import math
from typing import Any

from muslin.grading.record import Record


def render(record: Record) -> str:
    """The record as JSON.

    JSON has no infinity, no NaN and no half surrogate pairs: the numbers become null, the text is written out.
    """
    return json.dumps(_strict(record.as_json()), indent=1, ensure_ascii=True, allow_nan=False) + "\n"


def _strict(value: Any) -> Any:
    if isinstance(value, dict):
        return {_strict(key): _strict(entry) for key, entry in value.items()}
    if isinstance(value, list):
        return [_strict(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, str):
        return value.encode("utf-8", "backslashreplace").decode("utf-8")
    return value
