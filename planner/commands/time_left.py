"""How much time a plan still needs, from what it has told of itself so far.

Nobody knows beforehand how many rounds a spline gets, or whether a verdict asks for another one. The time left is the sum of what is
still most likely, counted in a unit that this job has measured itself: one grid and one solve on it (the last ones of the rounds),

    rounds     those that the effort allows, fewer as soon as their gains fall; each as long as the last one
    after      final grid, single corners, tightening:  AFTER units of that grid; on corners alone a share of their solve
    verdict    samples times SAMPLE seconds, at the speed of this machine, which the first solve tells
    prices     PRICES units
    files      samples times WRITTEN seconds, if any are written

less what the stage that is running has had already. Where a stage tells what share of it is done, that takes the place of what was
expected. Before the first solve tells a share nothing is known, and nothing is said. The numbers were read off plans of a
dozen programs; `benchmarks/progress.py` says how true the estimates are on these and on others.

Plans whose geometry and feed are searched together go another way (search_left.py).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from planner.base.names import NORMAL
from planner.commands.search_left import BEGUN, PLANNING, SearchLeft

if TYPE_CHECKING:
    from planner.job.trace import Step
    from planner.optimal.effort import Search

ROUND = 4.5  # of the first round, in units
AFTER, PRICES = 2.5, 2.5  # in units, the first of the final grid
FINAL_AFTER = 2.0  # what comes after the final grid, over that, as soon as it is solved [-]
MORE_ROUNDS = 1.5  # rounds that there are, over those by which gains would fall to `ENOUGH` [-]
IN_VAIN = 5, 3.0  # after so many rounds there are so many more: that gain too little before they are given up
AFTER_CORNERS, PRICES_CORNERS = 0.3, 0.6  # where there are no splines, of the one solve
POINT = 0.85e-6  # of a grid point and an iteration of the solver, on the machine where the others were measured [s]
SAMPLE = 4e-6  # of a sample in a verdict [s]: 2.4e-6 to 6.6e-6
WRITTEN = 1.5e-6  # of a sample in the files [s]
LEAST_WORK = 0.02  # that tells the speed of a machine [s]
SPEED = (0.2, 20.0)  # how slow a machine may be, against that one [-]
SLOWER = 1.2  # cycle time over that at the programmed feed, as long as nothing else is known [-]
RIVAL = 0.5  # further verdicts of other plans on corners alone
LAST_GAINS = 2  # rounds whose geometric mean counts: some gain little between others that gain much
SHARE_TOLD = 0.03  # a share of a stage that is done tells something from here on [-]
SURE = 2.0  # times the share that is done: how far it is trusted, against what was expected [-]
LATE = 0.3  # of the time it has had, what a stage that has had more than expected still gets
FALLING = 0.3  # gain of a round over the gain of the one before, as long as there is only one
STEADY = 0.8  # the same at most
SEEN = (
    5  # rounds that gain next to nothing before they are given up, where they do not keep what they promise
)
ENOUGH = 1e-5  # gain after which there are no more rounds [share of the time]

LEAST_STEPS = 2  # of a motion that is searched on a segment of the path (methods/optimal.py)

BEGIN, ROUNDS, FINISH, DELIVER, REPORT, DONE = range(6)  # where a plan is, in this order


@dataclass
class TimeLeft:
    """An estimator; it is told of stages and steps with the time [s] of each.

    solves : whether the method solves a problem on a grid ("optimal", "second-order")
    effort : of the plan
    rounds : of reshaping that the user asked for, or None
    writes : whether files are written
    searched : whether a search for geometry and feed together may come
    """

    solves: bool = True
    effort: str = NORMAL
    rounds: int | None = None
    writes: bool = False
    searched: bool = False
    _phase: int = BEGIN
    _began: dict[str, float] = field(default_factory=dict)  # of the stages, the last time
    _now_in: str = ""
    _share: float = 0.0
    _since: float = 0.0  # when the present phase or round began
    _grid: float = 0.0
    _unit: float = math.nan
    _speed: float = 1.0
    _points: int = 0
    _splines: bool = False
    _cycle_time: float = 0.0
    _dt: float = math.inf
    _final: float = math.nan  # what the final grid took [s]
    _verdict_took: float = math.nan
    _resolution: object = None
    _plans: int = 0
    _round: float = math.nan
    _gains: list[float] = field(default_factory=list)
    _slower: bool = False  # the last round as a whole
    _told: float = 0.0  # when something was told last
    _steps: int = 0  # that the motion has at least
    _search: SearchLeft | None = None  # where the plan goes that way

    def stage(self, now: float, name: str, fraction: float) -> None:
        """A stage begins (0), is done to a fraction, or ends (1)."""
        self._told = now
        if name == "search" and fraction == 0.0 and self._search is None:
            self._search = SearchLeft(phase=PLANNING)
        if self._search is not None:
            self._search.stage(now, name, fraction)
            if self._search.phase == PLANNING and not self._dial().again:
                self._without_search(now)
        if fraction == 0.0:
            if name == "solve" and self._now_in == "geometry":
                self._grid = now - self._began["geometry"]
            self._began[name] = now
            if name == "sample":
                self._began.pop("verify", None)  # there is another one to come
                self._go(DELIVER, now)
            elif name == "report" and self._phase == DELIVER:
                self._go(REPORT, now)
            elif name == "write":
                self._go(DONE, now)
        elif fraction == 1.0 and name == "verify":
            self._verdict_took = now - self._began["verify"]
        self._now_in, self._share = name, fraction

    def step(self, now: float, step: Step) -> None:
        """A step of the planning (job/trace.py)."""
        self._told = now
        if step.name == "programmed feed":
            self._cycle_time, self._dt = SLOWER * (step.found or 0.0), float(step.facts.get("dt") or math.inf)
            self._steps = LEAST_STEPS * int(step.facts.get("segments") or 0)
            if self.searched and self._steps <= self._dial().steps_max:
                self._search = SearchLeft(_since=now)
        elif step.name == "splines":
            if self._search is not None and self._search.phase == BEGUN:
                self._without_search(now)
            self._splines = bool(step.facts.get("runs"))
        elif step.name == "search" and self._search is not None:
            self._search.step(step)
            if self._search.in_vain:
                self._without_search(now)
        elif step.name == "solve":
            self._solved(now, step)
        elif step.name.startswith("reshape") and self._phase == ROUNDS:
            gain = max(step.gain or 0.0, 0.0)
            self._slower = not step.kept if "mixed" not in step.name else self._slower
            if "mixed" in step.name and self._gains:
                self._gains[-1] += gain
            else:
                self._gains.append(gain)
                self._round = now - self._since
                self._since = now
        elif step.name in ("final grid", "between points") and self._phase < FINISH:
            self._go(FINISH, now)
        elif step.name == "plan" and self._phase >= DELIVER:
            self._plans += 1
            self._go(DONE, now)
        if (
            step.found is not None
            and math.isfinite(step.found)
            and step.name in ("solve", "tighten", "final grid")
        ):
            self._cycle_time = self._cycle_time if self._phase > ROUNDS else step.found

    def left(self, now: float) -> float | None:
        """How much time is left [s]; None as long as nothing is known. What tells nothing gets a share of the time since it began."""
        found = self._expected(now)
        return None if found is None else max(found, LATE * (now - self._told))

    def _expected(self, now: float) -> float | None:
        write = self._samples() * WRITTEN * self._speed if self.writes else 0.0
        if self._search is not None and "write" not in self._began:
            return self._search.left(now, write, self._verdict_takes())
        if self._phase == DONE:
            return self._running(now, "write", write) + (self._verdict(now) if self._plans == 1 else 0.0)
        unit, later = self._unit, write + self._verdict(now)
        if self._phase == BEGIN and self.solves:
            share = self._share if self._now_in == "solve" else 0.0
            if share >= SHARE_TOLD:
                solve = (now - self._began["solve"]) / share
                unit = solve + self._grid
                later += solve * (1.0 - share)
            elif math.isnan(unit):
                return None
            else:  # begun anew
                later += self._rest(now - self._since, unit)
        elif not self.solves or self._plans:
            return later
        prices = (PRICES if self._splines else PRICES_CORNERS) * unit
        after = (AFTER * self._finer() if self._splines else AFTER_CORNERS) * unit
        if not math.isnan(self._final):
            after = FINAL_AFTER * self._final
        later += prices if self._phase < REPORT else self._running(now, "report", prices)
        if self._phase <= FINISH:
            later += after if self._phase < FINISH else self._rest(now - self._since, after)
        if self._phase <= ROUNDS and self._splines:
            each = ROUND * unit if math.isnan(self._round) else self._round
            more = self._more_rounds()
            had = now - self._since if self._phase == ROUNDS else 0.0
            later += max(more - 1.0, 0.0) * each + (self._rest(had, each) if more > 0 else 0.0)
        return later

    def _dial(self) -> Search:
        from planner.optimal.effort import EFFORTS

        return EFFORTS[self.effort].search.of(self._steps)

    def _without_search(self, now: float) -> None:
        """The plan begins anew, and there is no search in it: on splines, until it tells that it has none."""
        self._search, self._splines = None, True
        self._go(BEGIN, now)

    def _go(self, phase: int, now: float) -> None:
        self._phase, self._since = phase, now

    def _solved(self, now: float, step: Step) -> None:
        resolution = step.facts.get("resolution")
        if self._phase == ROUNDS and resolution != self._resolution:
            self._final = now - self._began.get("solve", now) + self._grid
            self._go(FINISH, now)
        if self._phase > ROUNDS:
            return
        self._resolution = resolution
        seconds = now - self._began.get("solve", now)
        self._unit = seconds + self._grid
        self._points = int(step.facts.get("points") or 0)
        solved = self._points - int(step.facts.get("held") or 0)
        work = solved * int(step.facts.get("iterations") or 1) * POINT
        if self._phase == BEGIN:
            if work > LEAST_WORK:
                self._speed = math.sqrt(min(max(seconds / work, SPEED[0]), SPEED[1]))
            self._go(ROUNDS if self._splines else FINISH, now)

    def _finer(self) -> float:
        """How many times as many points the final grid has as that of the rounds, about: its error goes with their square."""
        from planner.optimal.effort import EFFORTS

        sizes = EFFORTS[self.effort].grids(self._points)
        return math.sqrt(sizes.rounds / sizes.final)

    def _more_rounds(self) -> float:
        """Rounds that are still to be expected."""
        from planner.optimal.effort import EFFORTS

        effort = EFFORTS[self.effort]
        made = len(self._gains)
        most = self.rounds
        if most is None:
            most = min(effort.work // max(self._points, 1), effort.rounds)
        if not made:
            return min(most, 5.0)
        enough = max(effort.left, ENOUGH)
        gain = math.exp(
            sum(math.log(max(g, 0.1 * enough)) for g in self._gains[-LAST_GAINS:])
            / len(self._gains[-LAST_GAINS:])
        )
        if self._slower:
            idle = next((k for k, g in enumerate(reversed(self._gains)) if g > enough), made)
            return max(min(most - made, float(max(SEEN - idle, 1))), 0.0)
        if self._gains[-1] <= enough and made <= IN_VAIN[0]:
            return min(most - made, 1.0)
        falling = FALLING if made < 2 else (gain / max(self._gains)) ** (1.0 / (made - 1))
        falling = min(max(falling, FALLING), STEADY)
        more = (MORE_ROUNDS if made > 1 else 1.0) * math.log(gain / enough) / -math.log(falling) + (
            IN_VAIN[1] if made > IN_VAIN[0] else 0.0
        )
        return max(min(most - made, more), 0.0)

    def _samples(self) -> float:
        return self._cycle_time / self._dt

    def _verdict_takes(self) -> float:
        """Time of a verdict [s]."""
        found = self._verdict_took
        return self._samples() * SAMPLE * self._speed if math.isnan(found) else found

    def _verdict(self, now: float) -> float:
        """What is left of verdicts."""
        each = self._verdict_takes()
        rivals = RIVAL * each if self.solves and not self._splines and self._plans < 2 else 0.0
        if self._phase < DELIVER:
            return each + rivals
        if self._phase > DELIVER:
            return rivals
        here = self._running(now, "verify", each)
        return here + (0.0 if self._plans else rivals)

    def _running(self, now: float, stage: str, expected: float) -> float:
        """What is left of a stage of which so much time was expected, from the time or the share that it has had."""
        if self._now_in != stage:
            return expected if stage not in self._began else 0.0
        had = now - self._began[stage]
        if self._share >= 1.0:
            return 0.0
        if self._share > SHARE_TOLD:
            sure = min(SURE * self._share, 1.0)
            whole = sure * had / self._share + (1.0 - sure) * expected
            return max(whole - had, LATE * had * (1.0 - self._share))
        return self._rest(had, expected)

    @staticmethod
    def _rest(had: float, expected: float) -> float:
        return max(expected - had, LATE * had)
