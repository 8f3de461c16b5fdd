"""How much time a plan still needs whose geometry and feed are searched together (methods/optimal.py).

Such a plan is a sequence of attempts, and each tells what the next one may take:

    begun      splines, a grid, a solve: took B
    search     on it: FIRST times B, and S as soon as the share of the steps that is done tells it
    delivery   sampled, judged, priced:  a verdict, and DELIVERY of the search
      and where that search leaves anything:
    plan       of the first splines, fit for delivery:  PLAN times B
    search     from the plan: S once more, then a delivery
      and where that leaves much:
    rounds     of reshaping, and a plan:  ROUNDS times the plan before; a search and a delivery

What a later attempt would take is counted as soon as the one before it has failed, and not before: most do not fail. How true that is
`benchmarks/progress.py` says; the numbers were read off its ten plans.
"""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.job.trace import Step

FIRST = 5.0  # a search over the splines, grid and solve before it: 4 to 25 [-]
DELIVERY = 0.05  # sampling and prices after a search, over the search [-]
PLAN = 3.0  # a plan of the first splines over the splines, grid and solve before it [-]
ROUNDS = 2.5  # reshaping and a plan over the plan of the first splines [-]
LATE = 0.3  # of the time it has had, what an attempt that has had more than expected still gets [-]
SURE = 2.0  # times the share that is done: how far it is trusted, against what was expected [-]

LAST = 0.3  # the last part of the time that it has had [-]
LEAST_SHARE = 0.01  # that is counted as done in it [-]

BEGUN, SEARCH, DELIVER, PLANNING = range(4)  # where a plan is, in this order, several times


@dataclass
class SearchLeft:
    """An estimator, told of stages and steps with the time [s] of each.

    phase   : where the plan is
    in_vain : there will be no search
    """

    phase: int = BEGUN
    in_vain: bool = False
    _since: float = 0.0  # when the phase began
    _share: float = 0.0  # of the search that is done
    _searches: int = 0
    _begun: float = 0.0  # B
    _plan: float = 0.0  # what the last plan took
    _whole: float = 0.0  # S
    _told: list[tuple[float, float]] = field(default_factory=list)  # when which share of it was done

    def stage(self, now: float, name: str, fraction: float) -> None:
        """A stage begins (0), is done to a fraction, or ends (1)."""
        if name == "search" and fraction == 0.0 and self.phase in (BEGUN, PLANNING):
            self._search_begins(now)
        elif name == "search" and self.phase == SEARCH and fraction < 1.0:
            self._share = max(self._share, fraction)
            self._told.append((now, self._share))
        elif name == "geometry" and fraction == 0.0 and self.phase in (SEARCH, DELIVER):
            if self.phase == SEARCH:
                self._whole = self._expected_search(now)
            self._go(PLANNING, now)
        elif name == "sample" and fraction == 0.0 and self.phase == SEARCH:
            self._whole = now - self._since
            self._go(DELIVER, now)

    def step(self, step: Step) -> None:
        """A step of the planning (job/trace.py): a search that is none says why."""
        if step.name == "search":
            self.in_vain |= bool({"left", "of"} & step.facts.keys())

    def left(self, now: float, written: float, verdict: float) -> float | None:
        """How much time is left [s], `written` of it for the files, where a verdict takes so much; None as long as nothing is known."""
        had = now - self._since
        if self.phase == BEGUN:
            return None
        if self.phase == DELIVER:
            return _rest(had, DELIVERY * self._whole + verdict) + written
        search = self._expected_search(now)
        later = DELIVERY * search + verdict + written
        if self.phase == PLANNING:
            return (
                _rest(had, PLAN * self._begun if self._searches < 2 else ROUNDS * self._plan) + search + later
            )
        return max(search - had, LATE * had * (1.0 - self._share)) + later

    def _go(self, phase: int, now: float) -> None:
        self.phase, self._since, self._share = phase, now, 0.0
        self._told = [(now, 0.0)]

    def _search_begins(self, now: float) -> None:
        if self.phase == BEGUN:
            self._begun = now - self._since
            self._whole = FIRST * self._begun
        else:
            self._plan = now - self._since
        self._searches += 1
        self._go(SEARCH, now)

    def _expected_search(self, now: float) -> float:
        """What the search takes [s]: from its share, the more the more of it is done, and from what was expected."""
        if self.phase != SEARCH or not self._share:
            return self._whole
        sure = min(SURE * self._share, 1.0)
        return sure * self._by_share(now) + (1.0 - sure) * self._whole

    def _by_share(self, now: float) -> float:
        """What the search takes [s] if the rest of it goes on as all of it until now, or as the last part: their geometric mean."""
        had = now - self._since
        before, share = self._told[bisect_left(self._told, (now - LAST * had, 0.0)) - 1]
        left = 1.0 - self._share
        recent = (now - before) * left / max(self._share - share, LEAST_SHARE)
        return had + float((had * left / self._share * recent) ** 0.5)


def _rest(had: float, expected: float) -> float:
    return max(expected - had, LATE * had)
