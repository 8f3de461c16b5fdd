"""Where the feed changes at a vertex: which block the motion of a search is on (joint/switches.py), and what is found on long arcs."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from starts import MACHINE, begun_on

from planner.geometry.build import toolpath_from_program
from planner.joint.own import TubeOwn
from planner.joint.runs import tube_runs_of
from planner.joint.switches import places_in_order, switches_missed
from planner.nc.reader import parse_program

RADIUS = 8.0  # [mm]


def arc_and_line(degrees, before, after):
    """An arc from the origin, F `before`, and a line tangent to its end, F `after` [mm/min]."""
    turned = np.radians(degrees)
    x, y = RADIUS * (np.cos(turned) - 1.0), RADIUS * np.sin(turned)
    end = x - 6.0 * np.sin(turned), y + 6.0 * np.cos(turned)
    return parse_program(
        f"G21 G17 G90 G64 P0.03\nG3 X{x:.6f} Y{y:.6f} I{-RADIUS} J0 F{before}\nG1 X{end[0]:.6f} Y{end[1]:.6f} F{after}\nM2\n"
    )


def line_and_arc(before, after):
    """A line, F `before`, and an arc of 270 degrees behind it, F `after` [mm/min]."""
    return parse_program(
        f"G21 G17 G90 G64 P0.03\nG1 Y6 F{before}\nG3 X{-RADIUS} Y{6 - RADIUS} I{-RADIUS} J0 F{after}\nM2\n"
    )


def run_of(program):
    (run,) = tube_runs_of(toolpath_from_program(program, MACHINE), MACHINE)
    assert len(run) == 2
    return run


def places_along(run, begin, end, steps=40):
    """Legs of steps, and nodes (n, A) that follow the path evenly from the place `begin` [mm] before its vertex to `end` behind it."""
    ends = run.length[0]
    places = [np.linspace(ends - begin, ends, steps), np.linspace(0.0, end, steps + 1)]
    of = np.append(np.zeros(steps, dtype=int), np.ones(steps, dtype=int))
    return np.repeat([0, 1], [steps - 1, steps]), run.points(of, np.append(places[0], places[1][1:]))


def motion(leg, points, speed=20.0):
    """A motion through points at about a speed [mm/s], as `switches_missed` takes it: leg, h, state, jerk."""
    h = np.linalg.norm(np.diff(points, axis=0), axis=1) / speed
    through = CubicSpline(np.append(0.0, np.cumsum(h)), points, bc_type="natural")
    state = np.stack([through(through.x, order) for order in range(3)], axis=1)
    return leg, h, state, through(through.x[:-1], 3)


@pytest.mark.parametrize("degrees", [30, 179, 190, 300, 355, 359.9])
@pytest.mark.parametrize("feeds", [(3000, 1200), (1200, 3000)])
def test_the_path_itself_switches_at_the_vertex(degrees, feeds):
    """Its nearest place to the vertex is the vertex, however far the arc turns."""
    run = run_of(arc_and_line(degrees, *feeds))
    assert run.switch[1] == (1.0 if feeds[0] > feeds[1] else -1.0)
    assert switches_missed(run, *motion(*places_along(run, run.length[0], run.length[1]), 50.0)) is None


@pytest.mark.parametrize("degrees", [30, 300])
@pytest.mark.parametrize(("feeds", "late"), [((3000, 1200), -1), ((1200, 3000), 1)])
def test_a_node_on_the_slower_side_of_the_nearest_place_is_not_kept(degrees, feeds, late):
    """The node of the vertex a fifth of its budget behind it where the feed falls, before it where the feed rises: what lies between
    runs at the larger F, though the motion is on the other block. Where it keeps the smaller F there nothing is missed."""
    run = run_of(arc_and_line(degrees, *feeds))
    leg, points = places_along(run, 5.0, 5.0)
    node = int(np.flatnonzero(np.diff(leg))[0]) + 1
    ahead = points[node + 1] - points[node - 1]
    moved = -late * 0.2 * run.vertex_budget[1] * ahead / np.linalg.norm(ahead)
    missed = switches_missed(run, *motion(leg, points + moved, 50.0))
    assert missed is not None
    assert missed.leg[node] == 1
    assert switches_missed(run, *motion(leg, points - moved, 50.0)) is None
    assert switches_missed(run, *motion(leg, points + moved, 19.0)) is None


@pytest.mark.parametrize("degrees", [30, 300])
def test_a_motion_that_was_nearer_before_its_node_is_not_kept(degrees):
    """It comes as near as half the budget, goes away and comes back within the budget: the judge's switch is the first time."""
    run = run_of(arc_and_line(degrees, 3000, 1200))
    leg, points = places_along(run, 5.0, 5.0)
    node = int(np.flatnonzero(np.diff(leg))[0]) + 1
    budget = run.vertex_budget[1]
    ahead = points[node + 1] - points[node]
    onward = ahead / np.linalg.norm(ahead)
    points[node - 1], points[node] = (
        run.vertex[1] + 0.5 * budget * onward,
        run.vertex[1] + 0.9 * budget * onward,
    )
    assert switches_missed(run, *motion(leg, points, 50.0)) is not None


@pytest.mark.parametrize("feeds", [(3000, 1200), (1200, 3000)])
def test_between_nodes_as_many_places_tell(feeds):
    """Random motions round the vertex, against 4,000 places of every step: whether the faster leg comes nearer than the slower one."""
    run, counts = run_of(arc_and_line(30, *feeds)), {True: 0, False: 0}
    random, fine = np.random.default_rng(3), np.linspace(0.0, 1.0, 4001)[:, None]
    for _ in range(60):
        leg = np.repeat([0, 1], random.integers(1, 4, 2))
        points = run.vertex[1] + random.normal(size=(len(leg) + 1, len(run.axis))) * run.vertex_budget[1]
        leg, h, state, jerk = motion(leg, points, 500.0)
        p, v, a = (state[:-1, None, order] for order in range(3))
        t = fine * h[:, None, None]
        apart = np.linalg.norm(p + t * (v + t * (a / 2 + t * jerk[:, None] / 6)) - run.vertex[1], axis=2).min(
            axis=1
        )
        of = [apart[leg == one].min() for one in (0, 1)]
        fast, slow = of if feeds[0] > feeds[1] else of[::-1]
        if abs(fast - slow) > 1e-6:
            missed = switches_missed(run, leg, h, state, jerk) is not None
            assert missed == (fast < slow)
            counts[missed] += 1
    assert min(counts.values()) > 10


def test_a_node_before_a_step_that_comes_back_is_to_be_further_from_the_vertex():
    """At both nodes of the step the way is away from the vertex; between them it is nearer. About the place that is told the first node
    is on the wrong side."""
    run = run_of(arc_and_line(30, 1200, 3000))
    leg, h, state = np.array([0, 1]), np.full(2, 1e-3), np.zeros((3, 3, len(run.axis)))
    along, across = np.eye(len(run.axis))[:2]
    begin = run.vertex[1] + run.vertex_budget[1] * across
    jerk = np.outer([-1e9, 3e8], across)
    state[1] = begin, 21.0 * along + 1e-3 * across, -4e4 * across
    for node, t, one in ((0, -h[0], jerk[0]), (2, h[1], jerk[1])):
        (p, v, a), j = state[1], one
        state[node] = p + t * (v + t * (a / 2 + t * j / 6)), v + t * (a + t * j / 2), a + t * j
    assert (((state[1:, 0] - run.vertex[1]) * state[1:, 1]).sum(axis=1) > 0.0).all()
    missed = switches_missed(run, leg, h, state, jerk)
    assert missed is not None
    assert ((begin - missed.at[1]) * state[1, 1]).sum() < 0.0


@pytest.mark.parametrize("program", [arc_and_line(285, 2400, 900), line_and_arc(900, 2400)])
def test_on_an_arc_of_more_than_half_a_turn_what_is_found_is_taken(program):
    """In one window, as it is: nothing of the start is left."""
    found = TubeOwn(stays=False).solve(*begun_on(program))
    assert found.steps is not None
    assert not found.kept.any()


def test_where_a_faster_leg_comes_nearer_the_search_gets_rows_beside_the_vertex():
    """A block of 1.4 mm at F500 in a tolerance of 0.2 mm: what is found first changes its feed on the edge of the tolerance, where the
    way to the vertex turns, and is nearer elsewhere. With rows there too no node of a faster leg is nearer."""
    program = "G21 G90 G17 G94\nG64 P0.2\nG1 X5 F1500\nX6 Y1 F500\nX10 Y3 F1500\nM2\n"
    run, guess = begun_on(parse_program(program))
    found = TubeOwn(stays=False).solve(run, guess)
    assert found.steps is not None
    assert found.windows == 1
    p, v, a = found.steps.position, found.steps.velocity, found.steps.acceleration
    state = np.concatenate([np.stack([p, v, a], axis=1), guess.state[-1:]])
    assert switches_missed(run, guess.leg, found.steps.h, state, found.steps.jerk) is None


@pytest.mark.parametrize("steps", [3, 8])
@pytest.mark.parametrize("seed", range(40))
def test_points_passed_together_have_the_least_sum_of_squares_in_order(seed, steps):
    """Random motions past random points, against the best of all places in order, 400 on every step; those that are together have one
    place, nearest to their mean."""
    random = np.random.default_rng(seed)
    ahead = np.array([1.0, 0.3])
    nodes = np.linspace(0.0, 3.0, steps + 1)[:, None] * ahead + 0.4 / steps * random.normal(
        size=(steps + 1, 2)
    )
    points = np.sort(random.uniform(0.2, 2.8, 7))[:, None] * ahead + 0.8 * random.normal(size=(7, 2))
    _, h, state, jerk = motion(np.zeros(steps, dtype=int), nodes)
    place, stands = places_in_order(points, state, jerk, h)
    assert (np.diff(place) >= 0.0).all()

    def at(places):
        n = np.minimum(places.astype(int), len(h) - 1)
        t = ((places - n) * h[n])[:, None]
        return state[n, 0] + t * (state[n, 1] + t * (state[n, 2] / 2 + t * jerk[n] / 6))

    fine = np.arange(0, steps * 400 + 1) / 400
    apart = ((at(fine)[None] - points[:, None]) ** 2).sum(axis=2)
    least = np.zeros(len(fine))
    for row in apart:
        least = np.minimum.accumulate(least + row)
    found = ((at(place) - points) ** 2).sum()
    assert found <= least[-1] + 1e-4
    for one in np.unique(place):
        group = place == one
        assert stands[group] == pytest.approx(np.tile(points[group].mean(axis=0), (group.sum(), 1)))


def test_a_fast_block_before_a_slow_one_within_the_tolerance_is_not_kept():
    """A slow block between two fast ones, with a vertex between them that is nearer than the tolerance: run at the larger F up to the
    node of the slow one's end, though it is on the slow block from its beginning on, the motion is missed; at its F it is not."""
    text = "G21 G17 G90 G64 P0.2\nG1 X3 F6000\nG1 X3.1 F3000\nG1 X3.4 F600\nG1 X6 F6000\nM2\n"
    (run,) = tube_runs_of(toolpath_from_program(parse_program(text), MACHINE), MACHINE)
    assert run.crowded[1:].all()
    leg = np.repeat([0, 1, 2, 3], [6, 1, 1, 6])
    ends = np.concatenate([np.linspace(0.0, 3.2, 7), [3.35, 3.4], np.linspace(3.5, 6.0, 6)])
    points = ends[:, None] * np.array([1.0, 0.0])[: len(run.axis)]
    missed = switches_missed(run, *motion(leg, points, 40.0))
    assert missed is not None
    assert (missed.leg[leg < 2] > 0).any()
    assert switches_missed(run, *motion(leg, points, 9.0)) is None
