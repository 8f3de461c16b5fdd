"""How old results are: each results/NAME.md begins with "Made by COMMAND at COMMIT on DATE", and its age is the number of commits that
changed the planner since; of a suite's report, since the oldest of its rows ("Rows of planner COMMIT, ...").

A figure that README.md quotes may be `README_LIMIT` commits old. The pages of docs/ quote measurements that take hours, and may quote
older ones; those above `STALE` are listed in results/ages.md, which `python -m benchmarks report` writes.
"""

from __future__ import annotations

import functools
import re
import subprocess
from dataclasses import dataclass
from pathlib import Path

from benchmarks.record import RESULTS, markdown, write_results

ROOT = Path(__file__).resolve().parent.parent.parent
NAME = "ages"  # of the list in results/
README_LIMIT = 300  # commits that changed the planner: about a week of this project's work
STALE = 200  # of the same, from which a result of docs/ is listed
_MADE = re.compile(
    r"Made by (?P<by>.+?) at (?:commit )?(?P<commit>[0-9a-f]{7,40})\+?,?(?: written)? on (?P<date>\d{4}-\d\d-\d\d)"
)
_ROWS = re.compile(r"Rows of planner ([0-9a-f+, ]+)\.")
_QUOTED = re.compile(r"\b([A-Za-z0-9_-]+\.md)\b")


@dataclass(frozen=True, kw_only=True)
class Made:
    """Where a result comes from, from its first line: command, commit and date, and the planners of a suite's rows."""

    by: str
    commit: str
    date: str
    planners: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Age:
    """A result that pages quote.

    pages   : that name it
    commits : that changed the planner since it was made; None where history does not reach so far
    """

    name: str
    pages: tuple[str, ...]
    made: Made
    commits: int | None


def made_of(first_line: str) -> Made | None:
    """What a result's first line says, or None where it says it not."""
    found, rows = _MADE.match(first_line), _ROWS.search(first_line)
    if found is None:
        return None
    planners = tuple(one.rstrip("+") for one in rows[1].split(", ")) if rows else ()
    return Made(**found.groupdict(), planners=planners)


def quoted(text: str, results: Path = RESULTS) -> list[str]:
    """Names of the result files that a page names, in order: those after "results/", and other names of files that are there."""
    after = set(re.findall(r"results/([A-Za-z0-9_-]+\.md)", text))
    names = [name for name in _QUOTED.findall(text) if name in after or _only_there(name, results)]
    return list(dict.fromkeys(names))


def _only_there(name: str, results: Path) -> bool:
    return (results / name).is_file() and not (ROOT / "docs" / name).is_file()


def pages() -> dict[str, str]:
    """README.md and the pages of docs/ by name."""
    files = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    return {str(file.relative_to(ROOT)): file.read_text(encoding="utf-8") for file in files}


def has_history() -> bool:
    """Whether this is a git checkout with all of its history."""
    try:
        return _git("rev-parse", "--is-shallow-repository") == "false"
    except (OSError, subprocess.CalledProcessError):
        return False


@functools.cache  # several results are of one commit
def commits_since(commit: str) -> int | None:
    """Commits since then that changed the planner; None where the commit is not one of this history."""
    try:
        _git("merge-base", "--is-ancestor", commit, "HEAD")  # what a rebase left behind is none
        return int(_git("rev-list", "--count", f"{commit}..HEAD", "--", "planner"))
    except (OSError, subprocess.CalledProcessError):
        return None


def ages() -> list[Age]:
    """The results that pages quote, the oldest first; results without an origin are left out."""
    names: dict[str, list[str]] = {}
    for page, text in pages().items():
        for name in quoted(text):
            names.setdefault(name, []).append(page)
    found = []
    for name, of_pages in names.items():
        file = RESULTS / name
        made = made_of(file.read_text(encoding="utf-8").split("\n")[0]) if file.is_file() else None
        if made is not None:
            since = [commits_since(commit) for commit in (made.commit, *made.planners)]
            known = [count for count in since if count is not None]
            commits = max(known) if len(known) == len(since) else None
            found.append(Age(name=name, pages=tuple(of_pages), made=made, commits=commits))
    return sorted(found, key=lambda age: -(age.commits or 0))


def too_old(found: list[Age], page: str, limit: int) -> list[Age]:
    """Those that a page quotes and that are older than so many commits."""
    return [age for age in found if page in age.pages and age.commits is not None and age.commits > limit]


def write_stale(folder: Path) -> list[Path]:
    """Write the list of stale results, where `folder` is that of the results and there is history."""
    if folder.resolve() != RESULTS.resolve() or not has_history():
        return []
    old = [age for age in ages() if age.name != f"{NAME}.md" and (age.commits is None or age.commits > STALE)]
    columns = ["result", "made at", "on", "commits since", "quoted in"]
    rows = [[age.name, age.made.commit, age.made.date, str(age.commits), ", ".join(age.pages)] for age in old]
    about = f"Results that are older than {STALE} commits to the planner:\n\n"
    table = markdown(columns, rows) if rows else "None.\n"
    write_results(NAME, {"rows": [dict(zip(columns, row, strict=True)) for row in rows]}, about + table)
    return [RESULTS / f"{NAME}.md"]


def _git(*arguments: str) -> str:
    ran = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return ran.stdout.strip()
