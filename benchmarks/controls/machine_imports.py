"""Which settings of controls become machine files, and why the others do not: every INI file below a folder.

    python -m benchmarks.controls.machine_imports [FOLDER] [--control NAME] [--pattern GLOB]

Without FOLDER, the sample configurations of Debian's package linuxcnc-uspace.
"""

from __future__ import annotations

import argparse
import re
from collections import Counter
from pathlib import Path
from typing import Any

from benchmarks.record import markdown, write_results

SAMPLES = Path("/usr/share/doc/linuxcnc/examples/sample-configs")
RESULT = "machine-imports"


def main() -> None:
    """Import all files and write results/machine-imports.json and .md."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path, nargs="?", default=SAMPLES)
    parser.add_argument("--control")
    parser.add_argument("--pattern", default="*.ini")
    options = parser.parse_args()
    files = sorted(options.folder.rglob(options.pattern))
    rows = [imported(file, options.folder, options.control) for file in files]
    said = Counter(note for row in rows for note in row.pop("notes"))
    write_results(RESULT, {"files": rows}, table(rows, said))
    print(table(rows, said))


def imported(file: Path, folder: Path, control: str | None) -> dict[str, Any]:
    """What comes of a file: its axes and notes, or the reason of the refusal."""
    from planner.base.errors import InputError
    from planner.controls.machine_import.convert import import_machine

    row: dict[str, Any] = {"file": str(file.relative_to(folder)), "axes": "", "reason": "", "notes": []}
    try:
        found = import_machine(file, control=control)
    except InputError as fault:
        return row | {"reason": fault.message}
    kinematics = found.machine.kinematics
    return row | {
        "axes": "".join(found.machine.axes) + (f", {kinematics.type}" if kinematics else ""),
        "notes": [note.replace(str(folder), "") for note in found.assumed],
    }


def table(rows: list[dict[str, Any]], said: Counter[str]) -> str:
    """How many files load, each refusal with its reason, and how often each kind of note is said."""
    refused = [[row["file"], row["reason"]] for row in rows if row["reason"]]
    counted: Counter[str] = Counter()
    for note, count in said.items():
        counted[kind(note)] += count
    axes = Counter(row["axes"] for row in rows if not row["reason"])
    return "\n".join(
        [
            f"{len(rows) - len(refused)} of {len(rows)} files become machine files.\n",
            markdown(["refused", "reason"], refused),
            markdown(["axes", "files"], [[name, str(count)] for name, count in axes.most_common()]),
            markdown(
                ["note, by its kind", "files"], [[note, str(count)] for note, count in counted.most_common()]
            ),
        ]
    )


def kind(note: str) -> str:
    """A note without its names and numbers: up to the first colon, axes and what has digits or points left out."""
    head = re.sub(r"(?<=of )[a-cu-z](?:, [a-cu-z])*|^[a-cu-z](?= is|$)", "AXES", note.split(": ")[0])
    named = [
        word if word.startswith("[") or not re.search(r"\d|\w\.\w", word) else "..." for word in head.split()
    ]
    return " ".join(named)


if __name__ == "__main__":
    main()
