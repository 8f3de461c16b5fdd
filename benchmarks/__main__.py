"""`python -m benchmarks`: run suites, report, compare two runs, list what there is (docs/benchmarks.md)."""

from __future__ import annotations

import argparse
import importlib.util
import sys
from importlib import import_module
from pathlib import Path

from planner.base.errors import InputError

CAMPAIGN = "benchmarks.campaign"


def main(argv: list[str] | None = None) -> int:
    """The exit code: 0, 1 where `compare` found something worse, 2 for input that is wrong."""
    given = sys.argv[1:] if argv is None else argv
    if given[:1] == ["campaign"]:
        return _campaign(given[1:])
    options = _parser().parse_args(given)
    try:
        return int(options.do(options))
    except InputError as fault:
        print(fault, file=sys.stderr)
        return 2


def _parser() -> argparse.ArgumentParser:
    from benchmarks.runner.measure import REPEATS
    from benchmarks.runner.run import FOLDER, LIMIT

    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    run = commands.add_parser("run", help="measure suites; rows go to the folder's SUITE.jsonl")
    run.add_argument("suites", nargs="*", metavar="SUITE", help="default: quick")
    run.add_argument(
        "--methods", nargs="+", help="METHOD[/CORNER][:EFFORT] ..., 'none'; default: the suite's"
    )
    run.add_argument("--peers", nargs="+", help="peers and models, 'all' or 'none'; default: the suite's")
    run.add_argument("--limit", type=float, default=LIMIT, help=f"of one call [CPU s], default {LIMIT:g}")
    run.add_argument(
        "--repeats", type=int, default=REPEATS, help=f"calls of a pair at most, default {REPEATS}"
    )
    run.add_argument("--only", nargs="+", default=[], help="patterns of job names")
    run.add_argument("--count", type=int, help="the first jobs of each suite")
    run.add_argument(
        "--processes", type=int, default=1, help="ways at a time; their times are marked as not quiet"
    )
    run.add_argument("--resume", action="store_true", help="not what the file has of this commit")
    run.add_argument("--folder", type=Path, default=FOLDER)
    run.set_defaults(do=_run)
    report = commands.add_parser(
        "report", help="tables and pictures of all runs, and the ages of the results"
    )
    report.add_argument("suites", nargs="*", metavar="SUITE", help="default: all that there are runs of")
    report.add_argument("--folder", type=Path, default=FOLDER)
    report.set_defaults(do=_report)
    compare = commands.add_parser(
        "compare", help="what got worse between two files of rows; exit code 1 if anything"
    )
    compare.add_argument("old", type=Path)
    compare.add_argument("new", type=Path)
    compare.set_defaults(do=_compare)
    listed = commands.add_parser("list", help="suites, ways and the other scripts, with what each is for")
    listed.set_defaults(do=_list)
    status = commands.add_parser(
        "status", help="how far each feature is known to be right, by the tests' marks"
    )
    status.set_defaults(do=_status)
    commands.add_parser("campaign", help="random jobs, judged twice (benchmarks/campaign)")
    return parser


def _run(options: argparse.Namespace) -> int:
    from benchmarks.runner.run import Request, run

    run(
        Request(
            suites=tuple(options.suites) or ("quick",),
            methods=None if options.methods is None else tuple(options.methods),
            peers=None if options.peers is None else tuple(options.peers),
            limit=options.limit,
            repeats=options.repeats,
            only=tuple(options.only),
            count=options.count,
            processes=options.processes,
            resume=options.resume,
            folder=options.folder,
        )
    )
    return 0


def _report(options: argparse.Namespace) -> int:
    from benchmarks.runner.report import write_reports

    for file in write_reports(options.folder, tuple(options.suites)):
        print(file)
    return 0


def _compare(options: argparse.Namespace) -> int:
    from benchmarks.runner.compared import changes, worse
    from benchmarks.runner.rows import read

    old, new = read(options.old).rows, read(options.new).rows
    found = changes(old, new)
    for change in found:
        print(change)
    bad = worse(found)
    print(f"{len(old)} rows compared: {len(bad)} worse, {len(new.keys() - old.keys())} new")
    return 1 if bad else 0


def _list(options: argparse.Namespace) -> int:
    from benchmarks.runner.listing import listed

    print(listed())
    return 0


def _status(options: argparse.Namespace) -> int:
    from benchmarks.status import main as written

    return written()


def _campaign(rest: list[str]) -> int:
    if importlib.util.find_spec(CAMPAIGN) is None:
        print(f"there is no {CAMPAIGN} here", file=sys.stderr)
        return 2
    return int(import_module(CAMPAIGN).main(rest) or 0)


if __name__ == "__main__":
    sys.exit(main())
