"""What a way that is not the planner gives back, or raises."""

from __future__ import annotations

from dataclasses import dataclass

from planner.verifier import Verdict


class NotApplicable(Exception):
    """A way that cannot plan this job, and why."""


class NotHere(Exception):
    """A way whose package is not installed here."""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A motion that others made: the verdict on it, its duration [s], and the quantities that it does not limit."""

    verdict: Verdict
    cycle_s: float
    free: tuple[str, ...] = ()
