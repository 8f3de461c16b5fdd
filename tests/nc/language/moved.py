"""Where the tool of a read program goes, sampled, and programs with a tool on a machine."""

from __future__ import annotations

import numpy as np

from planner.base.arrays import FloatArray
from planner.machine import Machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading
from planner.nc.writer import flat_program

AXES = {a: {"velocity": 100, "acceleration": 1000, "jerk": 1e4} for a in "xyz"}


def machine_with(diameter: float) -> Machine:
    """A machine whose tool 1 has a diameter."""
    return Machine(name="test", dt=1e-3, tolerance=0.05, axes=AXES, tools={"1": {"diameter": diameter}})  # type: ignore[arg-type]


def read_twice(text: str, machine: Machine, reading: Reading) -> Program:
    """The program, after its expanded text was read to the same moves."""
    program = parse_program(text, machine, reading)
    found = flat_program(text.encode(), machine, reading, source="text")
    assert found is not None
    again = parse_program(found[0], machine)
    assert again.kind.tolist() == program.kind.tolist()
    np.testing.assert_allclose(again.end, program.end, atol=1e-6)
    np.testing.assert_allclose(again.arc_sweep, program.arc_sweep, atol=1e-6)
    np.testing.assert_allclose(again.feed, program.feed, rtol=1e-6)
    return program


def sampled(program: Program, apart: float) -> tuple[FloatArray, FloatArray]:
    """Points (N, 3) along all moves, at most `apart` from the next in the move, and their block (N,)."""
    arcs = {
        int(b): (c, s)
        for b, c, s in zip(program.arc_block, program.arc_center, program.arc_sweep, strict=True)
    }
    points, block = [], []
    begin = np.zeros(3)
    for k, end in enumerate(program.end):
        if k in arcs:
            centre, sweep = arcs[k]
            spoke = complex(*(begin - centre)[:2])
            count = 2 + int(abs(sweep) * abs(spoke) / apart)
            part = np.linspace(0.0, 1.0, count)
            place = complex(*centre[:2]) + spoke * np.exp(1j * sweep * part)
            found = np.stack([place.real, place.imag, begin[2] + (end[2] - begin[2]) * part], axis=1)
        else:
            count = 2 + int(np.linalg.norm(end - begin) / apart)
            found = begin + np.linspace(0.0, 1.0, count)[:, None] * (end - begin)
        points.append(found)
        block.append(np.full(count, k))
        begin = end
    return np.concatenate(points), np.concatenate(block)


def is_rapid(program: Program, block: FloatArray) -> FloatArray:
    """Whether points of these blocks (N,) are passed at rapid speed."""
    return program.kind[block.astype(int)] == Kind.RAPID
