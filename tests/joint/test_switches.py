"""Where the feed changes at a vertex: which block the motion of a search is on (joint/checks.py), and what is found on long arcs."""

from __future__ import annotations

import numpy as np
import pytest
from starts import MACHINE, begun_on

from planner.geometry.build import toolpath_from_program
from planner.joint.checks import switches_missed
from planner.joint.own import TubeOwn
from planner.joint.run import tube_runs_of
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


def along(run, begin, end, steps=40):
    """Nodes that follow the path at a constant speed from the place `begin` [mm] before its vertex to `end` behind it: legs, state."""
    ends = run.length[0]
    places = [np.linspace(ends - begin, ends, steps), np.linspace(0.0, end, steps + 1)]
    leg = np.repeat([0, 1], [steps - 1, steps])
    of = np.append(np.zeros(steps, dtype=int), np.ones(steps, dtype=int))
    x = np.append(places[0], places[1][1:])
    state = np.zeros((len(x), 3, len(run.axis)))
    state[:, 0], state[:, 1] = run.points(of, x), 20.0 * run.tangents(of, x)
    return leg, state


@pytest.mark.parametrize("degrees", [30, 179, 190, 300, 355, 359.9])
@pytest.mark.parametrize("feeds", [(3000, 1200), (1200, 3000)])
def test_the_path_itself_switches_at_the_vertex(degrees, feeds):
    """Its nearest place to the vertex is the vertex, however far the arc turns."""
    run = run_of(arc_and_line(degrees, *feeds))
    assert run.switch[1] == (1.0 if feeds[0] > feeds[1] else -1.0)
    assert (switches_missed(run, *along(run, run.length[0], run.length[1])) < 0).all()


@pytest.mark.parametrize("degrees", [30, 300])
@pytest.mark.parametrize(("feeds", "late"), [((3000, 1200), -1), ((1200, 3000), 1)])
def test_a_node_on_the_slower_side_of_the_nearest_place_is_not_kept(degrees, feeds, late):
    """The node of the vertex a fifth of its budget behind it where the feed falls, before it where the feed rises: what lies between
    runs at the larger F, though the motion is on the other block."""
    run = run_of(arc_and_line(degrees, *feeds))
    leg, state = along(run, 5.0, 5.0)
    node = int(np.flatnonzero(np.diff(leg))[0]) + 1
    moved = state.copy()
    moved[:, 0] -= late * 0.2 * run.vertex_budget[1] * state[node, 1] / np.linalg.norm(state[node, 1])
    assert (switches_missed(run, leg, moved) >= 0).any()
    on_the_other = state.copy()
    on_the_other[:, 0] -= moved[:, 0] - state[:, 0]
    assert (switches_missed(run, leg, on_the_other) < 0).all()


@pytest.mark.parametrize("degrees", [30, 300])
def test_a_motion_that_was_nearer_before_its_node_is_not_kept(degrees):
    """It comes as near as half the budget, goes away and comes back within the budget: the judge's switch is the first time."""
    run = run_of(arc_and_line(degrees, 3000, 1200))
    leg, state = along(run, 5.0, 5.0)
    node = int(np.flatnonzero(np.diff(leg))[0]) + 1
    budget = run.vertex_budget[1]
    onward = state[node, 1] / np.linalg.norm(state[node, 1])
    state[node - 1, 0], state[node - 1, 1] = run.vertex[1] + 0.5 * budget * onward, 20.0 * onward
    state[node, 0], state[node, 1] = run.vertex[1] + 0.9 * budget * onward, -20.0 * onward
    assert (switches_missed(run, leg, state) >= 0).any()


@pytest.mark.parametrize("program", [arc_and_line(285, 2400, 900), line_and_arc(900, 2400)])
def test_on_an_arc_of_more_than_half_a_turn_what_is_found_is_taken(program):
    """In one window, as it is: nothing of the start is left."""
    found = TubeOwn(divide=False).solve(*begun_on(program))
    assert found.steps is not None
    assert not found.kept.any()


def test_where_a_faster_leg_comes_nearer_the_search_gets_rows_beside_the_vertex():
    """A block of 1.4 mm at F500 in a tolerance of 0.2 mm: what is found first changes its feed on the edge of the tolerance, where the
    way to the vertex turns, and is nearer elsewhere. With rows there too no node of a faster leg is nearer."""
    program = "G21 G90 G17 G94\nG64 P0.2\nG1 X5 F1500\nX6 Y1 F500\nX10 Y3 F1500\nM2\n"
    run, guess = begun_on(parse_program(program))
    found = TubeOwn(divide=False).solve(run, guess)
    assert found.steps is not None
    assert found.windows == 1
    p, v, a = found.steps.position, found.steps.velocity, found.steps.acceleration
    state = np.concatenate([np.stack([p, v, a], axis=1), guess.state[-1:]])
    assert (switches_missed(run, guess.leg, state) < 0).all()
