"""What stops a running program, as sentences."""

from __future__ import annotations


class Endless(ValueError):
    """A limit of the running program is reached; `what` says which."""

    def __init__(self, what: str):
        super().__init__(
            f"stopped after {what}: does this loop end? if it does, split the program "
            "(limits: TURNS_MAX, ROWS_MAX, BY_WORD_MAX in planner.nc.language.run)"
        )


class TooDeep(ValueError):
    """Too many calls are open."""


def sentence(fault: Exception) -> str:
    """What a Python error of the compiled program means."""
    text = str(fault)
    if isinstance(fault, ZeroDivisionError):
        return "division by zero"
    if isinstance(fault, OverflowError):
        return "the result is too large"
    if isinstance(fault, KeyError):
        return f"the named parameter #<{fault.args[0]}> has no value here; assign one before it is read"
    if text == "math domain error" or text.startswith("expected a"):
        return "the function or power is not defined for this number"
    return text
