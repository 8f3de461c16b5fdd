"""The same job, planned in other circumstances: are setpoints, program and summary the same to the last bit?

    python -m benchmarks.faults.determinism [--pythons PATH ...] [--jobs NAME ...]     into results/determinism.json and .md

Every job is planned by `planner plan` in a process of its own, with files; the first way is what the others are held against: other
numbers of threads, another order of Python's hashes, kernels compiled anew, two plans of it at the same time, and other
interpreters that have the package and what it needs (`--pythons .../bin/python`). Two plans are the same where every array of the
trajectory has the same bytes, planned.ngc too, and the summary but for its clock, versions and the run's own name; where they are
not, how far positions are apart is said. Rows of earlier runs stay, unless job and way run again.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.cost.growth import relief
from benchmarks.record import RESULTS, markdown, provenance, write_results

HERE = Path(__file__).parents[1]
ROTARY = "G21 G90 G64 P0.05\nF2000\nG1 X10 A10\nX20 Y5 A30 C20\nX15 Y15 C60\nA0 Y0\nX0 C0\nM2\n"
SHORT = "G21 G90 G64 P0.05\nG1 X20 F3000\nX40 Y10\nG2 X60 Y10 I10 J0\nG61\nG1 X70 Y30\nG64\nX50 Y50\nG4 P0.1\nX20 Y40\nX0 Y20\nM2\n"
FILTERED = "\n[fir]\ntime_constants = [0.008, 0.004]\n"
# Of a summary, what is of the run and not of the plan.
OF_THE_RUN = ("timings_s", "versions", "run_id", "sha256")


@dataclass(frozen=True)
class Asked:
    """A program and what `planner plan` is told beside it.

    filters : behind the machine, which is then a built-in one
    """

    text: str
    machine: str = "mill"
    more: tuple[str, ...] = ()
    filters: bool = False


def jobs() -> dict[str, Asked]:
    """The jobs by name."""
    bracket = (HERE.parent / "planner" / "examples" / "bracket.ngc").read_text(encoding="utf-8")
    made = {
        "bracket, normal": Asked(bracket),
        "bracket, router, quick": Asked(bracket, "router", ("--effort", "quick")),
        "bracket, splines only": Asked(bracket, "mill", ("--geometry", "spline")),
        "relief, 3,000 blocks": Asked(relief(3_000), "mill", ("--effort", "quick")),
        "five axes": Asked(ROTARY, str(HERE / "programs" / "mill-xyzabc.toml")),
        "filters": Asked(SHORT, "mill", (), True),
    }
    for method in ("second-order", "bezier", "kinematic", "fir", "fir-spline", "tube", "stop"):
        made[method] = Asked(SHORT, "mill", ("--method", method))
    return made


@dataclass(frozen=True)
class Way:
    """How a job is planned.

    beside : so many other processes plan it at the same time
    anew   : with every kernel compiled anew
    """

    name: str
    python: str = sys.executable
    threads: int = 1
    env: dict[str, str] = field(default_factory=dict)
    beside: int = 0
    anew: bool = False


def ways(pythons: list[str]) -> list[Way]:
    """The first is what the others are held against."""
    found = [
        Way("one thread"),
        Way("two threads", threads=2),
        Way("seven threads", threads=7),
        Way("other hashes", env={"PYTHONHASHSEED": "7"}),
        Way("two processes at once", threads=2, beside=1),
        Way("kernels compiled anew", threads=2, anew=True),
    ]
    for python in pythons:
        of = "import platform, numpy, numba; print(platform.python_version(), 'numpy', numpy.__version__, 'numba', numba.__version__)"
        version = subprocess.run(
            [python, "-c", of], capture_output=True, text=True, check=True
        ).stdout.strip()
        found.append(Way(f"Python {version}", python=python))
    return found


def planned(asked: Asked, way: Way, cache: Path) -> dict[str, Any]:
    """What a plan comes to: hashes of its parts, positions."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "job.ngc").write_text(asked.text, encoding="utf-8")
        machine = asked.machine
        if asked.filters:
            shown = subprocess.run(
                [way.python, "-m", "planner", "machine", "show", machine],
                capture_output=True,
                text=True,
                check=True,
            )
            (folder / "machine.toml").write_text(shown.stdout + FILTERED, encoding="utf-8")
            machine = "machine.toml"
        env = {
            name: value
            for name, value in os.environ.items()
            if name != "PYTHONPATH" or way.python == sys.executable
        }
        env |= way.env | ({"NUMBA_CACHE_DIR": str(cache)} if way.anew else {})
        command = [
            way.python,
            "-m",
            "planner",
            "plan",
            "job.ngc",
            "-m",
            machine,
            *asked.more,
            "--format",
            "npz",
            "-q",
        ]
        command += ["--threads", str(way.threads)]
        running = [
            subprocess.Popen([*command, "-o", f"out{k}"], cwd=folder, env=env, stdout=subprocess.DEVNULL)
            for k in range(1 + way.beside)
        ]
        codes = [process.wait() for process in running]
        if any(codes):
            raise RuntimeError(f"{way.name}: exit code {codes}")
        found = [_read(folder / f"out{k}") for k in range(1 + way.beside)]
        if any(other["same"] != found[0]["same"] for other in found):
            found[0]["same"] = dict.fromkeys(found[0]["same"], "not those of the other process")
        return found[0]


def _read(folder: Path) -> dict[str, Any]:
    with np.load(folder / "trajectory.npz") as file:
        arrays = {name: file[name] for name in sorted(file.files)}
    data = hashlib.sha256()
    for name, array in arrays.items():
        if array.dtype.kind in "fiub":
            data.update(name.encode() + array.tobytes())
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    of_plan = json.dumps(
        {key: value for key, value in summary.items() if key not in OF_THE_RUN}, sort_keys=True
    )
    return {
        "same": {
            "setpoints": data.hexdigest(),
            "planned.ngc": hashlib.sha256((folder / "planned.ngc").read_bytes()).hexdigest(),
            "summary": hashlib.sha256(of_plan.encode()).hexdigest(),
        },
        "time": summary["cycle_time_s"],
        "summary": json.loads(of_plan),
        "position": {name: array for name, array in arrays.items() if array.dtype.kind == "f"},
    }


def compared(first: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """Which parts differ, and by how much."""
    differ = [part for part, value in first["same"].items() if other["same"][part] != value]
    row: dict[str, Any] = {"differ": differ}
    if "setpoints" in differ:
        gap = 0.0
        for name, array in first["position"].items():
            of_other = other["position"].get(name)
            if of_other is None or of_other.shape != array.shape:
                gap = float("inf")
            elif "position" in name or name in "xyzabcuvw":
                gap = max(gap, float(np.abs(array - of_other).max(initial=0.0)))
        row |= {"gap": gap, "time": other["time"] / first["time"] - 1.0}
    elif "summary" in differ:
        keys = first["summary"].keys() | other["summary"].keys()
        row["keys"] = sorted(key for key in keys if first["summary"].get(key) != other["summary"].get(key))
    return row


def main() -> None:
    """Plan all jobs in all ways."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--pythons", nargs="*", default=[])
    parser.add_argument("--jobs", nargs="*")
    options = parser.parse_args()
    every = jobs()
    tried, kept = ways(options.pythons), _kept()
    commit = provenance()["commit"]
    with tempfile.TemporaryDirectory() as name:
        for job in options.jobs or every:
            first = planned(every[job], tried[0], Path(name))
            for way in tried[1:]:
                row = {"job": job, "way": way.name, "commit": commit}
                row |= compared(first, planned(every[job], way, Path(name)))
                print(json.dumps(row), flush=True)
                kept[job, way.name] = row
    names = list(dict.fromkeys(way for _, way in kept))
    table = [[job, *(_said(kept.get((job, way))) for way in names)] for job in every]
    write_results("determinism", {"rows": list(kept.values())}, markdown(["job", *names], table))


def _kept() -> dict[tuple[str, str], dict[str, Any]]:
    """The rows of earlier runs; those of jobs and ways that run again are replaced."""
    file = RESULTS / "determinism.json"
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"] if file.exists() else []
    return {(row["job"], row["way"]): row for row in rows}


def _said(row: dict[str, Any] | None) -> str:
    if row is None:
        return ""
    if not row["differ"]:
        return "same"
    if "gap" in row:
        return f"{row['gap']:.2g} mm, time by {row['time']:.2g}"
    return ", ".join(row.get("keys", row["differ"]))


if __name__ == "__main__":
    main()
