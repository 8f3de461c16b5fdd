"""Kernels compiled ahead: at installation, what the first plans will need.

    python -m planner.commands.ahead

plans two programs with the usual method, which compiles what is not kept yet, with the second process of first_run.py beside it, and
prints the files of all kernels that the plans have used. `setup.py` runs it and puts these files into the installation. What another
method, a curve of another kind or a longer job needs is compiled when it is first used.
"""

from __future__ import annotations

from planner.base import kernel_files, kernels
from planner.base.names import OPTIMAL
from planner.commands.first_run import Helper

MACHINE = "mill"
# Lines, arcs and a helix; with corners that are blended, passed without a stop, and stopped at; and one so short that other corners
# might be faster, which are planned beside it.
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
X0 Y20
G2 X10 Y20 Z-3 I5 J0
G1 X30
M2
""",
    "G21 G90 G64 P0.05 F2000\nG1 X10\nX12 Y5\nG3 X6 Y11 I-5 J1\nM2\n",
)


class _Starts(kernels.Compilation):
    """Starts the second process with the first kernel that is kept."""

    def __init__(self, helper: Helper):
        self._helper = helper

    def begins(self, is_kept: bool) -> None:
        """A kernel is about to be compiled."""
        if is_kept:
            self._helper.start()


def compile_ahead() -> list[str]:
    """Plan `PROGRAMS`; returns the files of the kernels that this took, sorted."""
    from planner.machine import load_machine
    from planner.methods.registry import plan
    from planner.nc.reader import parse_program

    machine = load_machine(MACHINE)
    with Helper(MACHINE, OPTIMAL) as helper:
        kernels.at_compilation(_Starts(helper))
        try:
            for program in PROGRAMS:
                plan(parse_program(program, machine), machine)
        finally:
            kernels.at_compilation(None)
    return kernel_files.used()


if __name__ == "__main__":
    print(*compile_ahead(), sep="\n")
