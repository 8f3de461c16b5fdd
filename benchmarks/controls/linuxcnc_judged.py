"""Motions of LinuxCNC itself before the verifier: none may be refused for what it does not do.

    python -m benchmarks.controls.linuxcnc_judged --peers FOLDER [--count N]     into results/linuxcnc-judged.json and .md

FOLDER and how LinuxCNC runs are those of `benchmarks.controls.rotary_linuxcnc`. The programs are the polylines of
`benchmarks.judge.verifier_trial`, under G64 with the machine's tolerance, and half of it, and Q0, and under G61.1, where LinuxCNC
rests at every vertex. The verifier gets the positions that HAL's sampler writes, six digits and one row per servo period. Jerk is
not judged: LinuxCNC has no limit of it.

LinuxCNC may really exceed something. What can be counted without the verifier stands beside its verdict: the largest difference
quotients of the positions over the limits, how far samples and chords' middles are from the polyline and vertices from the chords, over
the tolerance.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.controls.rotary_linuxcnc import STILL, on_linuxcnc
from benchmarks.judge.mutations import Case
from benchmarks.judge.verifier_trial import case, judged
from benchmarks.record import markdown, write_results
from planner.base.arrays import FloatArray
from planner.report.trajectory_reader import read_trajectory

# By name: the share of the tolerance that LinuxCNC is given, and a line before the moves.
MODES = {"G64": (1.0, ""), "G64, half of the tolerance": (0.5, ""), "G61.1": (1.0, "G61.1\n")}
# How well each is known from six digits: 5e-7 mm against differences over a period, or a tolerance of 0.01 mm [-].
COUNTED_TO = {"velocity": 1e-4, "acceleration": 5e-3, "feed": 1e-4, "contour": 1e-4, "vertex": 1e-4}


def moving(positions: FloatArray) -> FloatArray:
    """The positions from the last one at rest before the first move to the second at rest after the last one."""
    steps = np.flatnonzero((np.abs(np.diff(positions, axis=0)) > STILL).any(axis=1))
    return positions[max(steps[0] - 1, 0) : steps[-1] + 3]


def counted(positions: FloatArray, of: Case) -> dict[str, float]:
    """The largest velocity, acceleration, feed and distance from the polyline, each over what is allowed."""
    limits = {name: of.machine.limits(name, ("x", "y", "z")) for name in ("velocity", "acceleration")}
    first = np.diff(positions, axis=0) / of.machine.dt
    second = np.diff(first, axis=0) / of.machine.dt
    seen = np.vstack([positions, 0.5 * (positions[1:] + positions[:-1])])
    start, way = of.points[:-1], np.diff(of.points, axis=0)
    share = np.clip(np.einsum("nka,ka->nk", seen[:, None] - start, way) / np.sum(way**2, axis=1), 0.0, 1.0)
    off = np.linalg.norm(seen[:, None] - start - share[:, :, None] * way, axis=2).min(axis=1)
    return {
        "velocity": float((np.abs(first) / limits["velocity"]).max()),
        "acceleration": float((np.abs(second) / limits["acceleration"]).max()),
        "feed": float(np.linalg.norm(first, axis=1).max()) / of.feed,
        "contour": float(off.max()) / of.machine.tolerance,
        "vertex": max(_distance(vertex, positions) for vertex in of.points[1:-1]) / of.machine.tolerance,
    }


def _distance(point: FloatArray, positions: FloatArray) -> float:
    """Of a point (3,) from the chords of positions (n, 3) [mm]."""
    start, way = positions[:-1], np.diff(positions, axis=0)
    length = np.maximum(np.sum(way**2, axis=1), np.finfo(float).tiny)
    share = np.clip(np.sum((point - start) * way, axis=1) / length, 0.0, 1.0)
    return float(np.linalg.norm(point - start - share[:, None] * way, axis=1).min())


def row_of(seed: int, mode: str, peers: Path) -> dict[str, Any]:
    """A case in LinuxCNC: its verdict, and what was counted."""
    subject = case(seed)
    lines = [f"G1 X{x:.6f} Y{y:.6f} Z{z:.6f}" for x, y, z in subject.points[1:]]
    share, first = MODES[mode]
    text = f"{first}F{60.0 * subject.feed:.9g}\n" + "\n".join(lines) + "\n"
    machine = subject.machine.model_copy(update={"tolerance": share * subject.machine.tolerance})
    positions = moving(on_linuxcnc(text, machine, peers))
    t = subject.machine.dt * np.arange(len(positions))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "linuxcnc.csv"
        rows = np.column_stack([t, positions])
        np.savetxt(path, rows, fmt=["%.9f", *["%.6f"] * 3], delimiter=",", header="t,x,y,z", comments="")
        read = read_trajectory(path)
    verdict = judged(read.trajectory, subject.points, subject.feed, subject.machine, read.given, False)
    return {
        "case": seed,
        "mode": mode,
        "time": float(t[-1]),
        "planned": subject.plan.cycle_time,
        "method": subject.plan.method,
        "passed": verdict.passed,
        "said": verdict.sentences,
        **counted(positions, subject),
    }


def main() -> None:
    """Run LinuxCNC on all cases in both modes."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--peers", type=Path, required=True)
    parser.add_argument("--count", type=int, default=20)
    options = parser.parse_args()
    rows = []
    for seed in range(options.count):
        for mode in MODES:
            rows.append(row_of(seed, mode, options.peers))
            print(rows[-1], flush=True)
    kept = [all(row[name] <= 1.0 + digits for name, digits in COUNTED_TO.items()) for row in rows]
    false = sum(not row["passed"] for row, keeps in zip(rows, kept, strict=True) if keeps)
    said = f"{len(rows)} motions; {sum(kept)} keep what is counted, of which {false} were refused.\n\n"
    columns = [
        "case",
        "mode",
        "LinuxCNC [s]",
        *(f"{name} / allowed" for name in COUNTED_TO),
        "verdict",
        "says",
    ]
    table = [
        [
            str(row["case"]),
            row["mode"],
            f"{row['time']:.3f}",
            *(f"{row[name]:.4f}" for name in COUNTED_TO),
            "passed" if row["passed"] else "failed",
            row["said"][0] if row["said"] else "",
        ]
        for row in rows
    ]
    write_results("linuxcnc-judged", {"rows": rows}, said + markdown(columns, table))


if __name__ == "__main__":
    main()
