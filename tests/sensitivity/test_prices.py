"""What the limits cost: every price against plans made again with that limit changed, and against laws that need no second plan."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import pytest

import planner
from benchmarks.jobs import problems
from planner.corners.bezier import BezierCorner
from planner.corners.smooth import round_corners
from planner.feedrate.constraints.assemble import feedrate_problem
from planner.feedrate.constraints.limits import LIMITS
from planner.feedrate.grid import refine_for_jerk
from planner.feedrate.jerk.solver import JerkLimited
from planner.feedrate.sampling.samples import sample_path
from planner.geometry.build import toolpath_from_program
from planner.nc.reader import parse_program
from planner.planning.methods.optimal import SIGMA2, OptimalMethod
from planner.planning.optimal.geometry import corner_shape
from planner.sensitivity.path_prices import path_prices
from planner.sensitivity.prices import MORE_LIMIT, more_of
from planner.sensitivity.records import SAVED_MIN

MACHINE = problems.machine()
LINES = "G21 G90 G17\nF4800\nG1 X3\nX4 Y2.5\nX9 Y3\nX9.2 Y6\nX6 Y9\nX0 Y9.5\n"
ARCS = "G21 G90 G17\nF4800\nG1 X5\nG2 X9 Y-4 I0 J-4\nG1 Y-8\nX5 Y-10\nG3 X2 Y-13 I0 J-3\nG1 X0\n"
# A leg that is too short for its two corners, the second of which is the slower one.
SHARED = [[0, 0], [0.901, 2.025], [1.157, 2.648], [-0.097, 3.752], [0.016, 4.212], [-0.086, 6.879]]
QUANTITIES = ("velocity", "acceleration", "jerk")
STEP = 0.02  # of differences between plans [-]; below it the grid, which changes with the limits, is seen
NOTHING = 1e-3  # a derivative dT/d(ln limit) below this share of T is nothing: the grid's own changes


@dataclass(frozen=True)
class Job:
    """A program on a machine, planned as method `optimal` does, up to the solution on the grid."""

    program: object
    machine: object = MACHINE
    corner: str = "bezier"
    more: tuple[int, float] = (0, 0.0)  # joint, and what is added to its tolerance [mm]

    def __post_init__(self):
        toolpath = toolpath_from_program(self.program, self.machine)
        tolerance = toolpath.tolerance.copy()
        tolerance[self.more[0]] += self.more[1]
        toolpath = dataclasses.replace(toolpath, tolerance=tolerance)
        shape = (
            BezierCorner(sigma2=SIGMA2)
            if self.corner == "bezier"
            else corner_shape(self.corner, self.machine, toolpath)
        )
        path = round_corners(toolpath, self.machine, shape, blend_tangents=True)
        samples = refine_for_jerk(sample_path(path, self.machine, third_order=True), self.machine)
        problem = feedrate_problem(samples, self.machine)
        for name, value in (
            ("samples", samples),
            ("problem", problem),
            ("solution", JerkLimited().solve(problem).require()),
        ):
            object.__setattr__(self, name, value)

    @property
    def time(self) -> float:
        return self.solution.cycle_time

    def prices(self):
        return path_prices(self.samples, self.problem, self.solution, self.machine)

    def slope(self, changed) -> float:
        """dT/d(ln of something) from two more plans; `changed(factor)` gives what differs."""
        up, down = (dataclasses.replace(self, **changed(1.0 + step)).time for step in (STEP, -STEP))
        return (up - down) / (2.0 * STEP)


def text(program: str, machine=MACHINE):
    return parse_program(program, machine)


def with_limit(machine, name: str, factor: float):
    quantity, _, axis = name.partition(".")
    limits = machine.axes[axis]
    more = limits.model_copy(update={quantity: getattr(limits, quantity) * factor})
    return machine.model_copy(update={"axes": machine.axes | {axis: more}})


def with_feed(program, factor: float):
    return dataclasses.replace(program, feed=program.feed * factor)


def with_tolerance(machine, factor: float):
    return machine.model_copy(update={"tolerance": machine.tolerance * factor})


def limit(machine, name: str) -> float:
    quantity, _, axis = name.partition(".")
    return getattr(machine.axes[axis], quantity)


def names(job):
    return [f"{quantity}.{axis}" for quantity in QUANTITIES for axis in job.problem.axes]


@pytest.fixture(scope="module", params=["lines", "arcs", "slow axes"])
def job(request) -> Job:
    if request.param == "slow axes":  # which the programmed feed does not reach
        return Job(text(LINES), problems.machine(velocity=55.0))
    return Job(text({"lines": LINES, "arcs": ARCS}[request.param]))


@pytest.mark.shows("prices", "sampled: plans made again with that limit changed")
@pytest.mark.slow
def test_axis_limits_cost_what_plans_made_again_say(job):
    priced = job.prices()
    some = 0
    for name in names(job):
        slope = job.slope(lambda factor, name=name: {"machine": with_limit(job.machine, name, factor)})
        share = priced.limits[name] * limit(job.machine, name)
        assert share == pytest.approx(slope, rel=0.05, abs=NOTHING * job.time), name
        assert priced.saved[name] <= -share * MORE_LIMIT + NOTHING * job.time  # convex
        some += slope < -0.02 * job.time
    assert some >= 4


def test_the_feed_costs_what_plans_made_again_say(job):
    slope = job.slope(lambda factor: {"program": with_feed(job.program, factor)})
    assert job.prices().feed == pytest.approx(slope, rel=0.05, abs=NOTHING * job.time)


def test_prices_sum_up_to_the_cycle_time(job):
    """On the same path, time k times as fast is velocities times k, accelerations k^2, jerks k^3, feeds k, periods 1/k: derived by
    k, and with a period so short that its error budget is nothing,  sum v T_v + 2 a T_a + 3 j T_j + T_feed = -T."""
    short = job.machine.model_copy(update={"dt": 1e-6})
    job = dataclasses.replace(job, machine=short)
    priced = job.prices()
    order = dict(zip(QUANTITIES, (1, 2, 3), strict=True))
    total = sum(
        order[name.partition(".")[0]] * price * limit(short, name) for name, price in priced.limits.items()
    )
    assert total + priced.feed == pytest.approx(-job.time, rel=5e-3)


def test_a_limit_that_holds_nothing_costs_nothing():
    """At a crawl the feed is all there is: half of it takes twice the time."""
    job = Job(text(LINES.replace("F4800", "F6")))
    priced = job.prices()
    assert priced.feed == pytest.approx(-job.time, rel=0.02)
    for name in names(job):
        assert abs(priced.saved[name]) < 1e-3 * job.time, name
    assert priced.ranked()[0][0] == "feed"


def test_the_feed_is_worth_nothing_where_an_axis_is_as_slow():
    """Along x both are at their limit, and more feed alone saves nothing."""
    job = Job(problems.polyline([[0, 0], [80, 0]], feed=100.0), problems.machine(velocity=100.0))
    priced = job.prices()
    assert priced.feed == pytest.approx(0.0, abs=1e-9)
    faster = dataclasses.replace(job, program=with_feed(job.program, 1.0 + STEP))
    assert faster.time == pytest.approx(job.time, rel=1e-6)


def test_ranked_tells_what_saves_time_and_nothing_else(job):
    priced = job.prices()
    ranked = priced.ranked()
    saved = [seconds for _, seconds in ranked]
    assert saved == sorted(saved, reverse=True)
    assert min(saved) >= SAVED_MIN
    assert dict(ranked) == {name: value for name, value in priced.saved.items() if value >= SAVED_MIN}


@pytest.mark.parametrize(
    "program",
    [
        "G1 X10 F3000\n",
        "G61.1\nG1 X10 F3000\nY5\nX0\n",
        "G1 X0 F3000\nG2 X0 Y0 I5 J0\n",
        "G0 X10\nG4 P0.2\nG0 Y5\n",
    ],
    ids=["one line", "exact stops", "circle", "rapids and a dwell"],
)
def test_paths_without_corners(program):
    plan = OptimalMethod(corner="bezier").plan(text(program), MACHINE)  # beside the arc there would be room
    assert plan.prices.tolerance is None
    assert plan.prices.corners is None
    assert "tolerance" not in dict(plan.prices.ranked())
    assert sum(plan.prices.saved.values()) > 0.0


def test_a_plotter_file_has_prices(tmp_path):
    file = tmp_path / "square.plt"
    file.write_text("IN;SP1;PU0,0;PD1000,0;PD1000,1000;PD0,1000;PU;SP0;")
    plan = planner.plan(file, "plotter", method="optimal", corner="bezier")
    assert plan.prices.saved["jerk.x"] > 0.0


def test_a_solver_without_multipliers_has_no_prices():
    job = Job(text(LINES))
    with pytest.raises(ValueError, match="no multipliers"):
        path_prices(job.samples, job.problem, dataclasses.replace(job.solution, multipliers=None), MACHINE)

    class Silent:
        def solve(self, problem, progress=None):
            return dataclasses.replace(JerkLimited().solve(problem), multipliers=None)

    plan = OptimalMethod(solver=Silent()).plan(job.program, MACHINE)
    assert plan.solved
    assert plan.prices is None


@pytest.mark.parametrize("corner", ["spline", "bezier"])
def test_on_a_path_the_tolerance_has_no_price(corner):
    """It is laid before the feed is known; the limits have theirs."""
    plan = OptimalMethod(corner=corner).plan(text(LINES), MACHINE)
    assert plan.prices.tolerance is None
    assert "tolerance" not in plan.prices.saved
    assert plan.prices.saved["feed"] > 0.0


@pytest.mark.parametrize(
    "points", [[[0, 0], [6, 0]], [[0, 0], [6, 0], [9, 4]], [[0, 0], [6, 0], [9, 4], [4, 7]]]
)
def test_a_plan_on_splines_made_again_ends_elsewhere_and_one_without_any_does_not(points):
    """By 1e-3 of the time on both sides, which is all there is of a limit that is worth nothing."""
    plan = OptimalMethod(corner="spline").plan(problems.polyline(points, feed=90.0), MACHINE)
    unrest = 1e-3 * plan.cycle_time if len(points) > 2 else 0.0
    assert plan.prices.limits["velocity.z"] == 0.0
    assert plan.prices.ranges["velocity.z"] == pytest.approx((-unrest, unrest), rel=1e-3)


@pytest.mark.parametrize("limit", [limit for limit in LIMITS if limit.key], ids=lambda limit: limit.name)
def test_more_of_a_limit_of_the_whole_machine_is_more_of_its_key_alone(limit) -> None:
    machine = MACHINE.model_copy(update={limit.key: 200.0})
    assert more_of(machine, limit.name, 0.25) == machine.model_copy(update={limit.key: 250.0})


@pytest.mark.parametrize("quantity", ["velocity", "acceleration", "jerk"])
def test_more_of_a_limit_of_an_axis_is_of_that_axis_alone(quantity: str) -> None:
    more = more_of(MACHINE, f"{quantity}.y", 0.25)
    for name, axis in MACHINE.axes.items():
        by = 1.25 if name == "y" else 1.0
        assert more.axes[name] == axis.model_copy(update={quantity: by * getattr(axis, quantity)})
