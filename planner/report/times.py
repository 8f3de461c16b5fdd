"""Times in words."""

from __future__ import annotations

from planner.base.units import SECONDS_PER_MINUTE


def hours_text(seconds: float) -> str:
    """A time [s] in hours and minutes, in brackets behind a space; nothing below a minute."""
    if seconds < SECONDS_PER_MINUTE:
        return ""
    minutes, rest = divmod(seconds, SECONDS_PER_MINUTE)
    hours, minutes = divmod(int(minutes), 60)
    return f" ({hours} h {minutes} min {rest:.0f} s)" if hours else f" ({minutes} min {rest:.0f} s)"
