"""What every result file says about itself: command, commit, versions, machine."""

from __future__ import annotations

import datetime
import json
import os
import platform
import subprocess
import sys
from importlib import metadata
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
RESULTS = ROOT / "benchmarks" / "results"
PACKAGES = ("numpy", "scipy", "numba", "casadi", "toppra", "ruckig", "copp-py", "clarabel")


def provenance() -> dict[str, Any]:
    """Command, commit, versions and machine of this run; the commit with "+" where Python files have further changes."""
    changed = _git("status", "--porcelain", "--", ":/*.py")
    return {
        "command": "python -m " + " ".join([_module(), *sys.argv[1:]]),
        "commit": _git("rev-parse", "--short", "HEAD") + ("+" if changed else ""),
        "date": datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds"),
        "versions": {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES},
        "machine": f"{platform.machine()}, {os.cpu_count()} processors",
    }


def planner_state() -> str:
    """The last commit that changed the planner, with "+" where the working tree has further changes; "" without git."""
    last = _git("log", "-1", "--format=%h", "--", ":/planner")
    return last + ("+" if last and _git("status", "--porcelain", "--", ":/planner") else "")


def _git(*words: str) -> str:
    """What git says, "" where it says nothing or is not installed."""
    command, here = ["git", *words], Path(__file__).parent
    try:
        return subprocess.run(command, cwd=here, capture_output=True, text=True, check=False).stdout.strip()
    except OSError:
        return ""


def write_results(name: str, data: dict[str, Any], table: str) -> None:
    """Write results/NAME.json and results/NAME.md."""
    about = provenance()
    RESULTS.mkdir(exist_ok=True)
    (RESULTS / f"{name}.json").write_text(
        json.dumps({"about": about} | data, indent=1) + "\n", encoding="utf-8"
    )
    versions = ", ".join(f"{key} {value}" for key, value in about["versions"].items() if value)
    header = f"Made by `{about['command']}` at {about['commit']} on {about['date']} ({about['machine']}; {versions}).\n\n"
    (RESULTS / f"{name}.md").write_text(header + table, encoding="utf-8")


def markdown(columns: list[str], rows: list[list[str]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(columns) + " |", "|" + "---|" * len(columns)]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows]) + "\n"


def _module() -> str:
    spec = getattr(sys.modules["__main__"], "__spec__", None)
    return spec.name.removesuffix(".__main__") if spec is not None else Path(sys.argv[0]).stem


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
