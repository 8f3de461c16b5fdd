"""Drawings as lists of strokes: the path that follows from geometry alone, and the same drawing written in many dialects."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from planner.nc.program import Kind, Program

UNIT = 0.025  # [mm]
FINE = 1e-9  # [mm] rounding of coordinates around 1e3 mm, added up over a relative drawing


@dataclass(frozen=True)
class Move:
    """What the pen does next: a straight move or, with a sweep [rad], an arc; all in mm and mm/s."""

    down: bool
    end: tuple[float, float]
    feed: float
    centre: tuple[float, float] = (0.0, 0.0)
    sweep: float = 0.0


Stroke = tuple  # ("up" | "down", points) | ("arc", centre, degrees) | ("circle", radius) | ("box", corner) | ("speed", v)


def expected(strokes: list[Stroke]) -> list[Move]:
    """The path of a drawing, straight from the meaning of its strokes; coordinates in plotter units."""
    moves: list[Move] = []
    at, down, feed = np.zeros(2), False, math.inf

    def go(end, lowered, **arc):
        nonlocal at
        at = np.asarray(end, dtype=float)
        moves.append(Move(lowered, tuple(at * UNIT), feed if lowered else math.inf, **arc))

    for kind, *given_ in strokes:
        if kind in ("up", "down"):
            down = kind == "down"
            for point in given_[0]:
                go(point, down)
        elif kind == "arc":
            centre, sweep = np.array(given_[0], dtype=float), math.radians(given_[1])
            turn = np.array([[math.cos(sweep), -math.sin(sweep)], [math.sin(sweep), math.cos(sweep)]])
            end = centre + turn @ (at - centre)
            arc = {"centre": tuple(centre * UNIT), "sweep": sweep} if down else {}
            go(end, down, **arc)
        elif kind == "circle":
            centre = at
            go([centre[0] + given_[0], centre[1]], False)
            go(at, True, centre=tuple(centre * UNIT), sweep=2 * math.pi)
            go(centre, False)
        elif kind == "box":
            (x0, y0), (x1, y1) = at, given_[0]
            for corner in ((x1, y0), (x1, y1), (x0, y1), (x0, y0)):
                go(corner, True)
        else:
            feed = 10.0 * given_[0]
    return moves


@dataclass(frozen=True)
class Dialect:
    """How a program writes: between numbers, after instructions, capitals, absolute or relative, points per instruction."""

    comma: str
    end: str
    lower: bool
    relative: bool
    at_once: int
    decimals: bool
    by_plot: bool  # PD;PA1,2 in place of PD1,2

    def number(self, value: float) -> str:
        text = f"{value:.4f}" if self.decimals or value != round(value) else f"{value:.0f}"
        return "+" + text if self.comma == "" and not text.startswith("-") else text

    def line(self, name: str, *numbers: float) -> str:
        text = name + self.comma.join(self.number(value) for value in numbers)
        return (text.lower() if self.lower else text) + self.end


def written(strokes: list[Stroke], dialect: Dialect) -> str:
    """The drawing as HPGL. Relative coordinates are written to four decimals, which the strokes below have exactly."""
    said = [dialect.line("IN"), dialect.line("PR" if dialect.relative else "PA")]
    at, down = np.zeros(2), False
    for kind, *given_ in strokes:
        if kind in ("up", "down"):
            down = kind == "down"
            name = "PD" if down else "PU"
            points = np.array(given_[0], dtype=float).reshape(-1, 2)
            plotted = np.diff(points, axis=0, prepend=at[None]) if dialect.relative else points
            if dialect.by_plot or not len(points):
                said.append(dialect.line(name))
                name = "PR" if dialect.relative else "PA"
            for first in range(0, len(points), dialect.at_once):
                said.append(dialect.line(name, *plotted[first : first + dialect.at_once].ravel()))
            at = points[-1] if len(points) else at
        elif kind == "arc":
            centre = np.array(given_[0], dtype=float)
            said.append(
                dialect.line("AR", *(centre - at), given_[1])
                if dialect.relative
                else dialect.line("AA", *centre, given_[1])
            )
            at = 2 * centre - at  # the arcs below are half circles, or full ones
            at = at if abs(given_[1]) == 180 else 2 * centre - at
        elif kind == "circle":
            said.append(dialect.line("CI", given_[0]))
        elif kind == "box":
            corner = np.array(given_[0], dtype=float)
            said.append(
                dialect.line("ER", *(corner - at)) if dialect.relative else dialect.line("EA", *corner)
            )
        else:
            said.append(dialect.line("VS", given_[0]))
    return "".join(said)


whole = st.integers(-20000, 20000)
point = st.tuples(whole, whole)
stroke = st.one_of(
    st.tuples(st.sampled_from(["up", "down"]), st.lists(point, max_size=4)),
    st.tuples(st.just("arc"), point, st.sampled_from([180, -180, 360, -360])),
    st.tuples(st.just("circle"), st.integers(1, 5000)),
    st.tuples(st.just("box"), point),
    st.tuples(st.just("speed"), st.integers(1, 60)),
)
dialect = st.builds(
    Dialect,
    comma=st.sampled_from([",", " ", " , ", ",\r\n", ""]),
    end=st.sampled_from([";", "", ";\n", "\r\n;", " "]),
    lower=st.booleans(),
    relative=st.booleans(),
    at_once=st.integers(1, 3),
    decimals=st.booleans(),
    by_plot=st.booleans(),
)


def path_of(program: Program) -> list[Move]:
    """The moving blocks of a program."""
    arc = {block: row for row, block in enumerate(program.arc_block.tolist())}
    moves = []
    for k, kind in enumerate(program.kind):
        if kind <= Kind.ARC:
            end = tuple(program.end[k, :2])
            how = {}
            if k in arc:
                centre = tuple(program.arc_center[arc[k], :2])
                how = {"centre": centre, "sweep": program.arc_sweep[arc[k]]}
            moves.append(Move(kind != Kind.RAPID, end, program.feed[k], **how))
    return moves


def assert_same_path(found: list[Move], wanted: list[Move], atol: float, *, feeds: bool = True) -> None:
    assert [(m.down, m.sweep != 0) for m in found] == [(m.down, m.sweep != 0) for m in wanted]
    for name in ("end", "centre", "sweep", *(["feed"] if feeds else [])):
        a, b = (np.array([getattr(m, name) for m in moves]) for moves in (found, wanted))
        np.testing.assert_allclose(a, b, rtol=1e-12, atol=atol, err_msg=name)


def drawable(strokes: list[Stroke]) -> bool:
    """No arc about the point that the pen stands on."""
    at = np.zeros(2)
    for kind, *given_ in strokes:
        if kind in ("up", "down") and given_[0]:
            at = np.array(given_[0][-1])
        elif kind == "arc":
            if (at == given_[0]).all():
                return False
            at = 2 * np.array(given_[0]) - at if abs(given_[1]) == 180 else at
    return True


drawings = st.lists(stroke, min_size=1, max_size=12).filter(drawable)
