"""What shaped setpoints cost: `--shaped` of method `optimal` for one vibration mode of 400 to 18 Hz.

    python -m benchmarks.solvers.shaped

Jobs are those of joint.py. Of each: cycle time without shaping, and by the mode how much longer the shaped motion takes, how far it
rings after the end over how far that without shaping does, and how it was planned. Results: benchmarks/results/shaped.json and .md.
"""

from __future__ import annotations

import numpy as np

import planner
from benchmarks.jobs.searched import jobs
from benchmarks.record import markdown, write_results
from planner.machine import Mode
from planner.motion.shaping import shaper_of

FREQUENCIES, DAMPING = (400.0, 100.0, 40.0, 18.0), 0.05
TEXT = (
    "Cycle time without shaping; then, by the frequency of the mode, how much more time the shaped motion takes, of which the\n"
    "shaper's length in brackets, and how far it rings after the end over how far the motion without shaping does.\n\n"
)
NAMES = ("pentagon, mill", "zig-zag, mill", "pentagon, peers", "circle, peers")


def left(plan: planner.Plan) -> float:
    """How far the mode is deflected after the end [mm]."""
    verdict = plan.require().verdict
    assert verdict is not None
    return max(float(mode.after.max()) for mode in verdict.ringing)


def main() -> None:
    rows: list[list[str]] = []
    for name, (program, machine) in jobs().items():
        if name not in NAMES:
            continue
        cells, time = [], np.nan
        for frequency in FREQUENCIES:
            shaken = machine.model_copy(update={"modes": (Mode(frequency=frequency, damping=DAMPING),)})
            plain, made = (planner.plan(program(), shaken, shaped=shaped) for shaped in (False, True))
            time = plain.cycle_time
            length = shaper_of(shaken.modes).length / time
            passed = "" if made.verdict is not None and made.verdict.passed else ", failed"
            more = f"+{100.0 * (made.cycle_time / time - 1.0):.2g} % ({100.0 * length:.2g} %)"
            cells.append(f"{more}, {left(made) / left(plain):.1e}{passed}")
        rows.append([name, f"{time:.6g}", *cells])
        print(*rows[-1], flush=True)
    columns = ["job", "time [s]", *(f"{frequency:g} Hz" for frequency in FREQUENCIES)]
    write_results("shaped", {"columns": columns, "rows": rows}, TEXT + markdown(columns, rows))


if __name__ == "__main__":
    main()
