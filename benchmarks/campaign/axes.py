"""Random jobs in up to nine axes, planned and judged: how many do not get a passing verdict?

    python -m benchmarks.campaign.axes [--count N] [--seed S] [--methods stop optimal ...]

A job has two to ten blocks that move any of x y z a b c u v w by lengths over three decades, with corners of all axes, of the linear or
the rotary ones alone, and on a machine with limits, radius and tolerance of its own. Writes results/axes-campaign.json and .md.
"""

from __future__ import annotations

import argparse

import numpy as np

import planner
from benchmarks.record import markdown, write_results
from planner.machine import Machine

ALL = "xyzabcuvw"


def job(seed: int) -> tuple[str, Machine]:
    """The program text and the machine of a seed."""
    rng = np.random.default_rng(seed)
    letters = "xy" + "".join(c for c in ALL[2:] if rng.random() < 0.5)
    if not set(letters) & set("abc"):
        letters += "a"
    axes = {}
    for letter in letters:
        scale = rng.uniform(0.3, 2.0, 3)
        axes[letter] = {
            "velocity": 200.0 * scale[0],
            "acceleration": 2000.0 * scale[1],
            "jerk": 4e4 * scale[2],
        }
    machine = Machine(
        name=f"random {seed}",
        dt=0.001,
        tolerance=float(10 ** rng.uniform(-2.3, -1.0)),
        rotary_radius=float(10 ** rng.uniform(0.5, 2.3)),
        axes=axes,
    )
    lines = [f"G21 G91 F{10 ** rng.uniform(2.5, 4.0):.0f}"]
    for _ in range(rng.integers(2, 11)):
        group = (letters, "".join(c for c in letters if c in "abc"), "xy")[rng.integers(3)]
        moved = [c for c in group if rng.random() < 0.6] or [group[0]]
        size = 10 ** rng.uniform(-1.0, 1.7)
        lines.append("G1 " + " ".join(f"{c.upper()}{rng.normal() * size:.4f}" for c in moved))
    return "\n".join(lines) + "\nM2\n", machine


def planned(seed: int, method: str) -> dict:
    """What became of a job: status, verdict, cycle time, and the first fault."""
    text, machine = job(seed)
    found = {"seed": seed, "method": method, "axes": "".join(machine.axes)}
    program = planner.read_program(text=text, machine=machine)
    plan = planner.plan(program, machine, method=method)
    if plan.verdict is None:
        return found | {"status": plan.status.name, "passed": False, "said": plan.sentence}
    return found | {
        "status": plan.status.name,
        "passed": plan.verdict.passed,
        "cycle_time": plan.cycle_time,
        "said": plan.verdict.sentences[0] if plan.verdict.sentences else "",
    }


def main() -> None:
    """Plan all of them, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--methods", nargs="+", default=["stop", "second-order", "optimal"])
    options = parser.parse_args()
    seeds = range(options.seed, options.seed + options.count)
    done = [planned(seed, method) for seed in seeds for method in options.methods]
    time = {(row["seed"], row["method"]): row.get("cycle_time") for row in done}
    rows = []
    for method in dict.fromkeys(row["method"] for row in done):
        of = [row for row in done if row["method"] == method]
        to_stop = [
            row["cycle_time"] / time[row["seed"], "stop"]
            for row in of
            if row.get("cycle_time") and time.get((row["seed"], "stop"))
        ]
        rows.append(
            [
                method,
                str(len(of)),
                str(sum(not row["passed"] for row in of)),
                f"{np.mean(to_stop):.4f}" if to_stop else "-",
            ]
        )
    table = markdown(["method", "jobs", "without a passing verdict", "cycle time / full stops"], rows)
    print(table)
    for row in done:
        if not row["passed"]:
            print(row)
    write_results("axes-campaign", {"jobs": done}, table)


if __name__ == "__main__":
    main()
