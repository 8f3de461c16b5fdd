"""Random jobs at the tool centre point: path and feed found together, against the time-optimal feed along splines.

    python -m benchmarks.judge.at_tip [--count N] [--effort NAME]      into results/at-tip.md and .json

Both verdicts are of other code, in the joints, with what the tip leaves its chord by between setpoints of the joints.
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from benchmarks.jobs.at_tip import job
from benchmarks.record import markdown, write_results
from planner.planning.methods.registry import plan

SEARCHED = "together"  # in the sentence of a plan whose path and feed were


def row(seed: int, effort: str) -> dict[str, Any]:
    """Both plans of a job in numbers."""
    program, machine = job(seed)
    found: dict[str, Any] = {"seed": seed, "kind": machine.name, "blocks": len(program), "dt_s": machine.dt}
    found["tolerance_mm"] = machine.tolerance
    for name, geometry in (("spline", "spline"), ("default", None)):
        began = time.process_time()
        made = plan(program, machine, effort=effort, geometry=geometry).require()
        assert made.verdict is not None
        found[name] = {
            "time_s": made.cycle_time,
            "passed": made.verdict.passed,
            "tolerance_used": made.verdict.contour.ratio,
            "searched": SEARCHED in made.sentence,
            "cpu_s": round(time.process_time() - began, 1),
        }
    return found


def main() -> None:
    """Plan the first `--count` jobs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--effort", default="quick")
    options = parser.parse_args()
    rows = [row(seed, options.effort) for seed in range(options.count)]
    gains = [1.0 - one["default"]["time_s"] / one["spline"]["time_s"] for one in rows]
    text = markdown(
        ["seed", "kinematics", "blocks", "dt [ms]", "tolerance [mm]", "along splines [s]", "together [s]", "shorter by", "CPU [s]"],
        [
            [
                *(str(one["seed"]), one["kind"], str(one["blocks"]), f"{one['dt_s'] * 1e3:g}", f"{one['tolerance_mm']:g}"),
                *(f"{one[name]['time_s']:.4f}" for name in ("spline", "default")),
                f"{gain:.2%}" if one["default"]["searched"] else "not searched",
                f"{one['spline']['cpu_s']}, {one['default']['cpu_s']}",
            ]
            for one, gain in zip(rows, gains, strict=True)
        ],
    )  # fmt: skip
    failed = sum(not one[name]["passed"] for one in rows for name in ("spline", "default"))
    searched = sum(one["default"]["searched"] for one in rows)
    text += (
        f"\n{len(rows)} jobs, {searched} of them searched; {np.mean(gains):.2%} shorter on the mean, {max(gains):.2%} at most, "
        f"{min(gains):.2%} at least; {failed} of {2 * len(rows)} plans fail their verdict. Effort: {options.effort}.\n"
    )
    print(text)
    write_results("at-tip", {"rows": rows}, text)


if __name__ == "__main__":
    main()
