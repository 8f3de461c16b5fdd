"""Kernels compiled at installation, what the first plans will need: `python -m planner.commands.ahead [corners]`.

Three programs are planned and bounded; files of all kernels used are printed. numba compiles one kernel at a time, so
`setup.py` runs it twice, side by side: with `corners` three moves on corners come to geometry, feedrate and verdict
while the other compiles reading and splines. Both keep their kernels in one place, and load what is there.
"""

import sys

from planner.base import kernel_files
from planner.base.names import OPTIMAL, SINGLE_CORNERS

MACHINE = "mill"
# Lines, arcs and a helix, and an F that changes; with corners that are blended, passed without a stop, and stopped at; and one so
# short that other corners might be faster, which are planned beside it. The last one is so long that windows of
# its search are solved side by side (joint/groups.py).
LEGS = 450
PROGRAMS = (
    """G21 G90 G17 G64 P0.02
G1 X20 F3000
X40 Y10
G2 X60 Y10 I10 J0
G3 X70 Y20 I0 J10
G1 X50 Y50
X50.2 Y50.1
X50.5 Y50.1
G61
X20 Y40 Z-1
G64 P0.02
X0 Y20 F2000
G2 X10 Y20 Z-3 I5 J0
G1 X30 F3000
M2
""",
    "G21 G90 G64 P0.05 F2000\nG1 X10\nX12 Y5\nG3 X6 Y11 I-5 J1\nM2\n",
    "\n".join(["G21 G90 G64 P0.02 F3000", *(f"G1 X{k} Y{k % 2}" for k in range(1, LEGS)), "M2\n"]),
)
POINTS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (1.0, 1.0, 0.0), (2.0, 1.0, 0.0))  # [mm]
FEED = 10.0  # [mm/s]
CORNERS = "corners"  # on the command line


def compile_ahead() -> list[str]:
    """Plan `PROGRAMS`; returns the files of the kernels that this took, sorted."""
    from planner.machine import load_machine
    from planner.nc.reader import parse_program
    from planner.planning.methods.registry import plan

    machine = load_machine(MACHINE)
    for program in PROGRAMS:
        _ = plan(parse_program(program, machine), machine).least_time
    return kernel_files.used()


def compile_corners() -> bool:
    """Plan moves through `POINTS`, then the last of the programs; returns whether both passed."""
    import numpy as np

    from planner.machine import load_machine
    from planner.nc.points import program_of_points
    from planner.nc.reader import parse_program
    from planner.planning.methods.registry import plan

    machine = load_machine(MACHINE)
    program = program_of_points(np.array(POINTS), np.full(len(POINTS) - 1, FEED), None)
    made = plan(program, machine, method=OPTIMAL, geometry=SINGLE_CORNERS)
    long = plan(parse_program(PROGRAMS[-1], machine), machine)
    return all(one.verdict is not None and one.verdict.passed for one in (made, long))


if __name__ == "__main__":
    if sys.argv[1:] == [CORNERS]:
        compile_corners()
    else:
        print(*compile_ahead(), sep="\n")
