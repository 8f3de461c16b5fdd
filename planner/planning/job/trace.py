"""The trace of a job, step by step: lines for a terminal, and JSON.

    trace = Trace()
    planner.plan(program, log=trace)
    print(trace.table())

A log is any callable that takes a `Step`; a `Trace` keeps them. Without one a step costs nothing but a call.

Times are those of the processor, so that a trace says the same on a machine that is busy with something else.
"""

import math
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

Fact = int | float | str | bool


@dataclass(frozen=True, kw_only=True)
class Step:
    """One thing that was done or tried."""

    at: float  # computing time of this process since the job began, at the end of the step [s]
    name: str  # what it was: "solve", "splines", "tighten", ...
    # cycle time of what it found [s]; NaN where nothing was found, None where a step has no time
    found: float | None = None
    # cycle time of the best until then [s], which `found` competes with; None where nothing competes
    before: float | None = None
    kept: bool | None = None  # whether it took the place of the best; None where nothing competes
    facts: dict[str, Fact] = field(default_factory=dict)  # numbers and words about it, by name

    @property
    def gain(self) -> float | None:
        """Share of the cycle time that was gained [-]; 0 where not kept, inf if nothing was there."""
        if self.kept is None or self.found is None or self.before is None:
            return None
        if not self.kept:
            return 0.0
        return 1.0 - self.found / self.before if math.isfinite(self.before) else math.inf

    def as_json(self) -> dict[str, Any]:
        """The step with times that are not numbers as None."""
        times = {"found": self.found, "before": self.before}
        finite = {name: None if t is None or not math.isfinite(t) else t for name, t in times.items()}
        return {"at": round(self.at, 6), "name": self.name, **finite, "kept": self.kept, **self.facts}


Log = Callable[[Step], None]
Progress = Callable[[str, float], None]


# How a stage tells of a step: the name, then the other fields of `Step` by name, and facts.
Tell = Callable[..., None]


def tell_nobody(name: str, **told: Any) -> None:
    """A `Tell` for where nobody listens."""


class Teller:
    """Makes steps for a log, with the time since it began."""

    def __init__(self, log: Log):
        self._log = log
        self._began = time.process_time()

    def __call__(
        self,
        name: str,
        *,
        found: float | None = None,
        before: float | None = None,
        kept: bool | None = None,
        **facts: Fact,
    ) -> None:
        at = time.process_time() - self._began
        self._log(Step(at=at, name=name, found=found, before=before, kept=kept, facts=facts))


HEADER = f"{'at':>8}  {'took':>7}  {'step':<22}  {'cycle time':>12}  {'gained':>8}  kept"


class Trace:
    """The steps of a job, in order; also a log that hands each of them on as a line.

    line : called with every line of the table, the header first
    """

    def __init__(self, line: Callable[[str], None] | None = None):
        self.steps: list[Step] = []
        self._line = line

    def __call__(self, step: Step) -> None:
        self.steps.append(step)
        if self._line is not None:
            if len(self.steps) == 1:
                self._line(HEADER)
            self._line(self._text(len(self.steps) - 1))

    def table(self) -> str:
        """All steps, one a line: when it ended, how long since the line before, what it was, the cycle time
        that it found, what share of the best one before that gains, whether it was kept, and facts."""
        return "\n".join([HEADER, *(self._text(k) for k in range(len(self.steps)))])

    def as_json(self) -> list[dict[str, Any]]:
        """All steps as JSON has them."""
        return [step.as_json() for step in self.steps]

    def _text(self, k: int) -> str:
        step = self.steps[k]
        took = step.at - (self.steps[k - 1].at if k else 0.0)
        found = "" if step.found is None else f"{step.found:.6g} s" if math.isfinite(step.found) else "none"
        gain = f"{step.gain:.1e}" if step.gain else ""
        kept = "" if step.kept is None else "yes" if step.kept else "no"
        facts = ", ".join(f"{name.replace('_', ' ')} {_said(value)}" for name, value in step.facts.items())
        return f"{step.at:7.2f}s  {took:6.2f}s  {step.name:<22}  {found:>12}  {gain:>8}  {kept:<4}  {facts}".rstrip()


def _said(value: Fact) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.4g}" if isinstance(value, float) else f"{value:,}" if isinstance(value, int) else value


class Stages:
    """Measures the time of the stages of a job, and tells the caller which stage is running.

    timings  : seconds by stage; a stage that runs several times is summed up
    progress : called with the stage's name and the fraction done
    log      : called with every step
    """

    def __init__(self, progress: Progress | None = None, log: Log | None = None):
        self.timings: dict[str, float] = {}
        self.tell: Tell = tell_nobody if log is None else Teller(log)
        self._progress = progress

    @contextmanager
    def stage(self, name: str) -> Iterator[Callable[[float], None]]:
        """Run a stage under the clock. Yields a function to call with the fraction done (0 to 1)."""
        self._tell(name, 0.0)
        began = time.perf_counter()
        try:
            yield lambda fraction: self._tell(name, fraction)
        finally:
            self.timings[name] = self.timings.get(name, 0.0) + time.perf_counter() - began
        self._tell(name, 1.0)

    def _tell(self, name: str, fraction: float) -> None:
        if self._progress is not None:
            self._progress(name, fraction)
