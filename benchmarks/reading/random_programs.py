"""Thousands of random NC programs, read here and by LinuxCNC's own interpreter: how many disagree?

    python -m benchmarks.reading.random_programs [--count N] [--seed S] [--kinds cycles offsets ...]

The programs and the comparison are those of tests/nc/test_random_agreement.py, which reads some hundreds; those of kind "language"
compute (tests/nc/language/language_programs.py). It needs rs274 and the module gcode (Debian package linuxcnc-uspace). Writes
results/random-programs.json and .md.
"""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
from pathlib import Path

from benchmarks.record import markdown, write_results

TESTS = Path(__file__).resolve().parents[2] / "tests" / "nc"
AT_ONCE = 500  # programs that one run of the oracle reads


def main() -> None:
    """Read the programs and write what became of them."""
    sys.path[:0] = [str(TESTS), str(TESTS / "language")]
    agreement = importlib.import_module("test_random_agreement")
    generator = importlib.import_module("language_programs").Generator
    agreement.KINDS["language"] = lambda rng: generator(rng).text()

    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=1000, help="programs of each kind")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kinds", nargs="+", default=list(agreement.KINDS))
    options = parser.parse_args()
    rows: list[dict[str, str | int]] = []
    for kind in options.kinds:
        total = agreement.Tally()
        for part in range(-(-options.count // AT_ONCE)):
            count = min(AT_ONCE, options.count - part * AT_ONCE)
            with tempfile.TemporaryDirectory() as folder:
                tally = agreement.compare(kind, count, options.seed + 1000 * part, Path(folder))
            for name in ("read", "refused", "gouges", "early", "blocks", "wrong"):
                setattr(total, name, getattr(total, name) + getattr(tally, name))
        print(*total.wrong, sep="\n", file=sys.stderr)
        rows.append(
            {
                "kind": kind,
                "programs": options.count,
                "blocks compared": total.blocks,
                "refused by both": total.refused,
                "refused here alone, as gouging": total.gouges,
                "refused by LinuxCNC alone, an arc that begins early": total.early,
                "disagree": len(total.wrong),
            }
        )
    table = markdown(list(rows[0]), [[str(value) for value in row.values()] for row in rows])
    print(table)
    write_results("random-programs", {"seed": options.seed, "rows": rows}, table)


if __name__ == "__main__":
    main()
