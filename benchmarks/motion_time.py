"""What more planning time buys: the motion of six jobs with every effort, and with rounds of reshaping in place of the search.

    python -m benchmarks.motion_time [--job NAME ...] [--threads N] [--again]

Every plan is made in a process of its own, twice: the first time kernels are loaded, the second time counts. Processor seconds are
those of the second plan on all cores. Rounds alone leave the search for geometry and feed together out (docs/speed.md). Each row is
written when it is done; a run that was cut off goes on where it ended, unless `--again` is given. Writes results/motion-time.json,
.md and .png.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.growth import planner_commit, relief
from benchmarks.record import RESULTS, markdown, write_results

ROOT = Path(__file__).resolve().parents[1]
PEERS = "../shared/machines/peers.toml"
JOBS = {  # programs, or blocks of a relief, and their machines
    "bracket": ("planner/examples/bracket.ngc", "mill"),
    "star and spiral": ("../shared/peers/programs/d_starspiral.ngc", PEERS),
    "chips": ("../shared/peers/programs/e_chips.ngc", PEERS),
    "relief of 2,000": ("2000", "mill"),
    "relief of 10,000": ("10000", "mill"),
    "vcarve": ("../shared/nc/CauldronDevelopmentLLC__CAMotics__vcarve.ngc", PEERS),
}
WAYS: tuple[dict[str, Any], ...] = (
    *({"effort": effort} for effort in ("quick", "normal", "best")),
    *({"rounds": rounds} for rounds in (0, 1, 3, 10)),
)
LIMIT = 400.0  # [s] of wall time for one process; what takes longer is left out, and said

CHILD = """
import json, sys, time
import planner
from planner.base.threads import use_threads
job, machine, settings, threads = sys.argv[1:]
use_threads(int(threads))
for _ in range(2):
    cpu = time.process_time()
    plan = planner.plan(job, machine, **json.loads(settings))
    cpu = time.process_time() - cpu
print(json.dumps({"motion_s": float(plan.trajectory.cycle_time), "passed": bool(plan.verdict.passed), "cpu_s": cpu}))
"""


def measured(job: Path, machine: str, settings: dict[str, Any], threads: int) -> dict[str, Any]:
    """What a plan takes; the error's last line if it fails."""
    command = [sys.executable, "-c", CHILD, str(job), machine, json.dumps(settings), str(threads)]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    try:
        done = subprocess.run(
            command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False, timeout=LIMIT
        )
    except subprocess.TimeoutExpired:
        return {"failed": f"not done after {LIMIT:g} s"}
    if done.returncode:
        return {"failed": (done.stderr.strip().splitlines() or [str(done.returncode)])[-1]}
    found: dict[str, Any] = json.loads(done.stdout.strip().splitlines()[-1])
    return found


def draw(rows: list[dict[str, Any]]) -> None:
    """A panel for each job: how much longer than the best the motion takes, against the planning time."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(2, 3, figsize=(11, 6.5), layout="constrained")
    for panel, name in zip(panels.ravel(), JOBS, strict=True):
        own = [row for row in rows if row["job"] == name and "cpu_s" in row]
        least = min((row["motion_s"] for row in own), default=1.0)
        for key, marker in (("rounds", "o"), ("effort", "s")):
            line = [row for row in own if key in row["settings"]]
            line.sort(key=lambda row: row["cpu_s"])
            longer = [100.0 * (row["motion_s"] / least - 1.0) for row in line]
            panel.plot([row["cpu_s"] for row in line], longer, marker, linestyle="--", label=f"by {key}")
            for row, y in zip(line, longer, strict=True):
                panel.annotate(
                    str(row["settings"][key]),
                    (row["cpu_s"], y),
                    xytext=(4, 4),
                    textcoords="offset points",
                    fontsize=8,
                )
        panel.set(
            title=f"{name}: {least:.5g} s",
            xscale="log",
            xlabel="planning [CPU s]",
            ylabel="longer than the best [%]",
        )
        panel.grid(alpha=0.3)
    panels[0, 0].legend()
    figure.savefig(RESULTS / "motion-time.png", dpi=110)


def main() -> None:
    """Run what is asked for, and write the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--job", nargs="*", choices=JOBS, default=list(JOBS))
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--again", action="store_true", help="also what the results hold of this commit")
    options = parser.parse_args()
    file, commit = RESULTS / "motion-time.json", planner_commit()
    rows: list[dict[str, Any]] = json.loads(file.read_text())["rows"] if file.exists() else []
    with tempfile.TemporaryDirectory() as scratch:
        for name in options.job:
            program, machine = JOBS[name]
            job = ROOT / program
            if program.isdigit():
                job = Path(scratch) / "relief.ngc"
                job.write_text(relief(int(program)))
            for settings in WAYS:
                key = {
                    "job": name,
                    "machine": Path(machine).stem,
                    "settings": settings,
                    "commit": commit,
                    "threads": options.threads,
                }
                if not options.again and any(key.items() <= row.items() for row in rows):
                    continue
                row = key | measured(job, machine, settings, options.threads)
                print(row, flush=True)
                rows = [old for old in rows if (old["job"], old["settings"]) != (name, settings)] + [row]
                write_results("motion-time", {"rows": rows}, _table(rows))
    draw(rows)


def _table(rows: list[dict[str, Any]]) -> str:
    cells = []
    for row in sorted(rows, key=lambda row: (list(JOBS).index(row["job"]), row.get("cpu_s", float("inf")))):
        way = ", ".join(f"{name} {value}" for name, value in row["settings"].items())
        found = [row["failed"], ""] if "failed" in row else [f"{row['motion_s']:.5g}", f"{row['cpu_s']:.2f}"]
        if not row.get("passed", True):
            found[0] += " (failed)"
        cells.append([row["job"], row["machine"], way, *found, row["commit"]])
    return markdown(["job", "machine", "way", "motion [s]", "planning [CPU s]", "commit"], cells)


if __name__ == "__main__":
    main()
