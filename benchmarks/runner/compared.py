"""Two files of rows: what got worse, what got better, and what got slower.

A pair of job and way is worse if its status or its verdict is worse, its cycle time longer by more than `SAME`, or if it is missing.
Processor times are told where they differ by more than `SLOWER`, and never count as worse: they depend on the machine and on what else
it does.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from benchmarks.runner.rows import FAILED, PASSED, SKIPPED, STATUSES, UNJUDGED, Key, Row

SAME = 1e-3  # share of the cycle time up to which two plans are alike: what a grid resolves [-]
SLOWER = 1.25  # ratio of processor times from which a job is named: two runs on one machine differ by some 10 % [-]
LITTLE = 0.05  # processor time below which a ratio says nothing [s]
_VERDICTS = (PASSED, UNJUDGED, FAILED)


@dataclass(frozen=True, kw_only=True)
class Change:
    """A pair of job and way whose rows differ, and how: "worse", "better", "slower", "quicker" or "not compared"."""

    key: Key
    kind: str
    says: str

    def __str__(self) -> str:
        return f"{self.kind}: {' / '.join(self.key)}: {self.says}"


WORSE, BETTER, SLOW, QUICK, APART = "worse", "better", "slower", "quicker", "not compared"


def changes(old: dict[Key, Row], new: dict[Key, Row]) -> list[Change]:
    """All changes from old to new, in the order of the pairs; rows that only `new` has are no change."""
    found = []
    for key, was in old.items():
        now = new.get(key)
        if now is None:
            found.append(Change(key=key, kind=WORSE, says="it is missing in the new results"))
        elif SKIPPED in (was.status, now.status):
            if was.status != now.status:
                here = now if now.status == SKIPPED else was
                found.append(Change(key=key, kind=APART, says=here.message))
        else:
            found += _of_pair(was, now)
    return found


def worse(found: Iterable[Change]) -> list[Change]:
    """Those that are worse."""
    return [change for change in found if change.kind == WORSE]


def _of_pair(was: Row, now: Row) -> list[Change]:
    outcome = _outcome(was, now)
    return [Change(key=now.key, kind=kind, says=says) for kind, says in (*outcome, *_speed(was, now))]


def _outcome(was: Row, now: Row) -> list[tuple[str, str]]:
    """Status, verdict and cycle time; of these the first that differs, because the next ones follow from it."""
    before, after = STATUSES.index(was.status), STATUSES.index(now.status)
    if before != after:
        return [(_sign(after - before), f"{was.status}, now {now.status}: {now.message}")]
    before, after = _VERDICTS.index(was.verdict), _VERDICTS.index(now.verdict)
    if before != after:
        return [(_sign(after - before), f"verdict {was.verdict}, now {now.verdict}: {now.message}")]
    if was.cycle_s is None or now.cycle_s is None:
        return []
    ratio = now.cycle_s / was.cycle_s
    if abs(ratio - 1.0) <= SAME:
        return []
    return [
        (_sign(ratio - 1.0), f"cycle time {was.cycle_s:.6g} s, now {now.cycle_s:.6g} s ({ratio - 1.0:+.2%})")
    ]


def _speed(was: Row, now: Row) -> list[tuple[str, str]]:
    if not was.cpu_s or not now.cpu_s or max(was.cpu_s, now.cpu_s) < LITTLE:
        return []
    ratio = now.cpu_s / was.cpu_s
    if 1.0 / SLOWER <= ratio <= SLOWER:
        return []
    busy = ", measured on a busy core" if was.noisy or now.noisy else ""
    return [
        (
            SLOW if ratio > 1.0 else QUICK,
            f"{was.cpu_s:.3g} CPU s, now {now.cpu_s:.3g}: ratio {ratio:.2f}{busy}",
        )
    ]


def _sign(difference: float) -> str:
    return WORSE if difference > 0 else BETTER
