"""Text and numbers as all views write them; what makes hostile text harmless is `muslin.base.text`."""

from __future__ import annotations

from decimal import ROUND_HALF_UP, Decimal

from muslin.base.text import capped, one_line, visible

__all__ = ["capped", "half_up", "one_line", "points", "visible"]


def points(value: float) -> str:
    """Points as people write them: 5, 2.5, 0.75."""
    return f"{value:.2f}".rstrip("0").rstrip(".")


def half_up(value: float) -> int:
    """The nearest whole number; a half goes up."""
    return int(Decimal(repr(round(value, 6))).quantize(Decimal(1), ROUND_HALF_UP))
