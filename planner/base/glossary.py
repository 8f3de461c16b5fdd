"""The vocabulary of the package: one word for one thing, in texts and in public names.

    python -m planner.base.glossary > docs/glossary.md

Symbols and units of numbers are in `planner.base.units`.
"""

from __future__ import annotations

# Six words for parts of a path, from the program to the grid.
PARTS = {
    "segment": "a line, an arc or a helix of the programmed path: what one block of the program moves along (`geometry/toolpath.py`)",
    "leg": "what lies between two corners: an arc, or lines that continue each other straight on, however many blocks cut them "
    "(`geometry/legs.py`)",
    "span": "the part of a B-spline between two neighbouring knots: one polynomial (`smoothing/basis.py`)",
    "element": "one curve of the smooth path, with its own parameter: what is left of a leg, a corner, or a span "
    "(`corners/elements.py`)",
    "run": "what lies between two full stops; of a spline, what it replaces: from one full stop, or the middle of a long straight leg, "
    "to the next (`smoothing/runs.py`)",
    "interval": "what lies between two neighbouring grid points: N intervals, N+1 points (`feedrate/sampling/samples.py`)",
}
# Words beside them, which are no parts of a path.
BESIDE = {
    "block": "one command of the NC program that moves the machine or lets it wait; it has a line number",
    "joint": "where two segments meet: a full stop, a smooth passage or a corner; those of `JointLimit` are a machine's",
    "corner": "a joint at which the direction changes and the motion does not stop; also the curve that rounds it",
    "vertex": "the programmed point of a corner",
    "chain": "legs, or links, one after the other, with the joints or vertices between them",
    "link": "a straight line of a chain that points are matched with: a segment, or one chord of it (`geometry/point_matching.py`)",
    "guide": "what FIR filters are led along: the legs of the program, or the fine chords of a smooth path (`baselines/fir/guide.py`)",
    "chord": "the straight line between two points of a curve: what the machine runs between two samples, or "
    "a line that stands for part of an arc",
    "combined step": "a step of path and feed together, with all limits linearised (`smoothing/combined.py`)",
    "piece": "a part of a motion, in time: each axis has constant jerk in it; of a feedrate problem, the grid points of one run; "
    "of a programmed curve, one rational cubic (`nc/bezier.py`)",
    "velocity pulse": "a leg of a guide, or some of it, that is commanded at one speed (`baselines/fir/command.py`); "
    "the pulses of a drive are the steps of its motor (`motion/pulses.py`)",
    "ramp": "where a motion only speeds up, or only brakes",
    "window": "neighbouring intervals, or spans, that are solved together",
    "row": "one line of a table, or one inequality of a problem",
}
TERMS = {
    "feed": "speed along the path [mm/s]; the programmed feed is the F word",
    "cycle time": "duration of the whole motion [s]",
    "look-ahead": "speeds at the joints that leave enough room to brake for everything that follows",
    "full stop": "a place at which the feed is zero",
    "dwell": "a full stop whose duration the program sets (G4)",
    "standstill": "a full stop whose duration the planner sets, so that filters settle or a sample falls on the vertex",
    "corridor": "all points within the tolerance of the path, also called the tube; splines stay inside it",
    "contour error": "distance of the motion from the programmed path",
    "vertex error": "distance of a vertex from the motion",
    "chord error": "how far the machine's chord between two samples cuts off the curve, kappa feed^2 dt^2 / 8",
    "error budget": "the tolerance, divided among rounding, chord error and the filters behind the setpoints",
    "ratio": "a value divided by its limit: 1 is at the limit",
    "limit": "the largest value that the machine or the program allows",
    "active limit": "a limit that the motion has reached; `held by` in the output tells for how much of the time, "
    "each in full",
    "binding": "said of a limit whose change would change the cycle time",
    "multiplier": "the cycle time that one unit of a limit is worth at the optimum, also called its shadow price",
    "sensitivity": "what a change of a limit or of the tolerance does to the cycle time; printed as `10 % more saves`",
    "setpoint": "one row of the trajectory: where the axes have to be at a sample time",
    "interpolation period": "the time between two setpoints, dt",
    "interpolation": "what the machine does within that: linear, cubic or hold (docs/files.md)",
    "profile": "feed, acceleration and jerk along the path as a solver finds them",
    "trajectory": "positions and their derivatives over time, one row per interpolation period",
    "verdict": "what the verifier says of a trajectory: every limit with its ratio, errors, faults, and whether it passed",
    "geometry": "how the programmed path becomes a smooth one: `spline`, `corners`, or `auto`",
    "method": "a way to plan a job; `optimal` is the default",
    "solver": "the algorithm that finds the feed along a given path",
}


def markdown() -> str:
    """The glossary as the page `docs/glossary.md`."""
    text = "# Glossary\n\nOne word for one thing. This page is made from `planner/base/glossary.py`.\n"
    for title, words in (
        ("Parts of a path", PARTS),
        ("Related words", BESIDE),
        ("Terms of the field", TERMS),
    ):
        text += f"\n## {title}\n\n| word | meaning |\n|---|---|\n"
        text += "".join(f"| {word} | {meaning} |\n" for word, meaning in words.items())
    return text


if __name__ == "__main__":
    print(markdown(), end="")
