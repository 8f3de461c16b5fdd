"""What came out wrong at an earlier commit, by command: before, after, and what is right.

    python -m benchmarks.faults.corrections --before DIR [--only TEXT]     into results/round3-corrections.md and .json

DIR is a checkout of the earlier commit, for example of `git worktree add ../before ecff72b5`. Each case of corrections.toml is a few
small files and the commands that are given them; what is shown are the places of the output, or of a file that was written, that its
pattern finds, or else the exit code and the last line. corrections.md, what tests show, is put behind the table.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

from benchmarks.record import ROOT, markdown, write_results

CASES = Path(__file__).with_suffix(".toml")
MORE = Path(__file__).with_suffix(".md")  # what tests show, written by hand
TIMEOUT = 600.0  # of a command [s]
SHOWN = 230  # characters of what came out


@dataclass(frozen=True, kw_only=True)
class Case:
    """One of corrections.toml.

    item  : what is wrong, in a few words
    right : what should come out, and why
    files : names and contents; a name of a folder has "/" in it
    run   : command lines, after `planner`; those that begin with "python" are Python's
    find  : regular expression for what is shown; its groups, if it has some
    file  : where it is looked for; "" for what the last command prints
    """

    item: str
    right: str
    run: list[str]
    find: str
    files: dict[str, str] = field(default_factory=dict)
    file: str = ""


def cases() -> list[Case]:
    """All cases, in the order of the file."""
    return [Case(**case) for case in tomllib.loads(CASES.read_text(encoding="utf-8"))["case"]]


def outcome(case: Case, checkout: Path) -> str:
    """What comes of a case with the planner of a checkout."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        for name, text in case.files.items():
            (place / name).parent.mkdir(parents=True, exist_ok=True)
            (place / name).write_text(text, encoding="utf-8")
        said, code = "", 0
        for line in case.run:
            said, code = _run(line, checkout, place)
        text = said
        if case.file:
            found = sorted(path for path in place.glob(case.file) if path.is_file())
            text = found[0].read_text(encoding="utf-8", errors="replace") if found else ""
        places = [
            " ".join(match.groups() or (match.group(),)) for match in re.finditer(case.find, text, re.M)
        ]
        if places:
            return _short(" / ".join(" ".join(part.split()) for part in places))
        last = said.strip().splitlines()[-1:] or [""]
        return _short(f"exit {code}: {last[0]}")


def _run(line: str, checkout: Path, place: Path) -> tuple[str, int]:
    words = line.split()
    command = (
        [sys.executable, *words[1:]] if words[0] == "python" else [sys.executable, "-m", "planner", *words]
    )
    environment = {**os.environ, "PYTHONPATH": str(checkout), "COLUMNS": "400", "PYTHONSAFEPATH": "1"}
    done = subprocess.run(
        command, cwd=place, env=environment, capture_output=True, text=True, errors="replace", timeout=TIMEOUT,
        check=False,
    )  # fmt: skip
    return done.stdout + done.stderr, done.returncode


def _short(text: str) -> str:
    text = text.replace("|", "/")
    return text if len(text) <= SHOWN else text[: SHOWN - 2] + " …"


def main() -> None:
    """Run all cases with both planners and write the table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.faults.corrections", description=__doc__.split("\n")[0]
    )
    parser.add_argument("--before", type=Path, required=True, help="a checkout of the earlier commit")
    parser.add_argument("--only", default="", help="cases whose item has this text; nothing is written then")
    options = parser.parse_args()
    rows = []
    for case in cases():
        if options.only in case.item:
            rows.append([case.item, outcome(case, options.before.resolve()), outcome(case, ROOT), case.right])
            print(*rows[-1], sep="\n    ", flush=True)
    if not options.only:
        commit = subprocess.run(
            ["git", "rev-parse", "--short", "HEAD"],
            cwd=options.before,
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        table = markdown(["what", f"at {commit}", "now", "right"], rows)
        write_results("round3-corrections", {"rows": rows}, f"{table}\n{MORE.read_text(encoding='utf-8')}")


if __name__ == "__main__":
    main()
