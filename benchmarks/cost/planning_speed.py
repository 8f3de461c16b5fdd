"""How long the motion takes and how long planning takes, for four jobs and every effort, next to earlier commits.

Every plan is made in a process of its own, twice: the first time kernels are loaded or compiled, the second time counts. Processor
seconds are those of the whole process in the second plan, on all cores; peak memory is that of both. Earlier commits are checked out
beside the project and run in the same environment, one plan after the other.

    python -m benchmarks.cost.planning_speed [COMMIT ...] [--job NAME ...] [--threads N]   into results/planning-speed.json and .md

What every effort of today brings on other jobs is in the reports of the suites ("Motion against planning time").
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks import record
from planner.base.names import EFFORTS

ROOT = Path(__file__).resolve().parents[2]
PEERS = ROOT.parent / "shared" / "machines" / "peers.toml"
PROGRAMS = ROOT.parent / "shared" / "peers" / "programs"
VCARVE = ROOT.parent / "shared" / "nc" / "CauldronDevelopmentLLC__CAMotics__vcarve.ngc"
JOBS = {  # programs and their machines
    "bracket": (ROOT / "planner" / "examples" / "bracket.ngc", "mill"),
    "star and spiral": (PROGRAMS / "d_starspiral.ngc", str(PEERS)),
    "chips": (PROGRAMS / "e_chips.ngc", str(PEERS)),
    "vcarve": (VCARVE, str(PEERS)),
}

CHILD = """
import json, resource, sys, time
import planner
job, machine, effort, threads = sys.argv[1:]
if threads != "0":
    from planner.base.threads import use_threads
    use_threads(int(threads))
settings = {"effort": effort} if effort != "-" else {}
found = planner.plan(job, machine, **settings)
cpu, wall = time.process_time(), time.perf_counter()
found = planner.plan(job, machine, **settings)
cpu, wall = time.process_time() - cpu, time.perf_counter() - wall
last = len(found.trajectory) - 1
print(json.dumps({
    "motion_s": float(found.trajectory.cycle_time),
    "passed": bool(found.verdict.passed),
    "cpu_s": cpu,
    "wall_s": wall,
    "blocks": int(len(found.program.kind)),
    "points": int(found.grid_points),
    "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
}))
"""


def measured(tree: Path, job: Path, machine: str, effort: str, threads: int) -> dict[str, object]:
    """What a plan of the package in `tree` takes; the error's last line if it fails."""
    arguments = [sys.executable, "-c", CHILD, str(job), machine, effort, str(threads)]
    done = subprocess.run(
        arguments,
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        return {
            "failed": done.stderr.strip().splitlines()[-1] if done.stderr.strip() else str(done.returncode)
        }
    row: dict[str, object] = json.loads(done.stdout.strip().splitlines()[-1])
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("commits", nargs="*", metavar="COMMIT")
    parser.add_argument("--job", nargs="+", choices=tuple(JOBS), default=tuple(JOBS))
    parser.add_argument("--threads", type=int, default=1)
    given = parser.parse_args()
    rows = []
    with tempfile.TemporaryDirectory() as place:
        trees = {}
        for commit in given.commits:
            trees[commit] = Path(place) / commit
            subprocess.run(
                ["git", "worktree", "add", "-q", "--detach", trees[commit], commit], cwd=ROOT, check=True
            )
        try:
            for job in given.job:
                program, machine = JOBS[job]
                ways = [(commit, tree, "-", 0) for commit, tree in trees.items()]
                ways += [("now", ROOT, effort, given.threads) for effort in EFFORTS]
                for name, tree, effort, threads in ways:
                    row = measured(tree, program, machine, effort, threads)
                    known = {"job": job, "machine": Path(machine).stem, "version": name, "effort": effort}
                    rows.append(known | row)
                    print(rows[-1], flush=True)
        finally:
            for tree in trees.values():
                subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=False)
    columns = [
        "job",
        "machine",
        "version",
        "effort",
        "motion [s]",
        "planning [CPU s]",
        "wall [s]",
        "blocks/s",
        "grid points",
        "peak [GB]",
    ]
    note = f"{given.threads} thread(s) now. The second plan in a process of its own.\n\n"
    table = note + record.markdown(columns, [_cells(row) for row in rows])
    record.write_results("planning-speed", {"rows": rows}, table)


def _cells(row: dict[str, object]) -> list[str]:
    """A row of the table."""
    start = [str(row[name]) for name in ("job", "machine", "version", "effort")]
    if "failed" in row:
        return [*start, str(row["failed"]), "", "", "", "", ""]
    cpu = float(str(row["cpu_s"]))
    return [
        *start,
        f"{row['motion_s']:.4f}" + ("" if row["passed"] else " (failed)"),
        f"{cpu:.2f}",
        f"{row['wall_s']:.2f}",
        f"{int(str(row['blocks'])) / cpu:,.0f}",
        f"{row['points']:,}",
        f"{row['peak_gb']:.2f}",
    ]


if __name__ == "__main__":
    main()
