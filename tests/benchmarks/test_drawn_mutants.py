"""Mutants: drawn alike for any count, one change each, none in what computes nothing; and what tests in a copy make of one."""

from __future__ import annotations

import ast
import json
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.mutants import ELSEWHERE, OPEN, SAME, counts, reasons
from benchmarks.mutants.covered import BUDGET, Covered, digest, statement
from benchmarks.mutants.draw import AREAS, drawn
from benchmarks.mutants.trial import KILLED, NO_END, SURVIVED, room_of
from benchmarks.record import ROOT


@pytest.mark.parametrize("area", AREAS)
def test_every_area_has_mutants_that_are_python(area: str) -> None:
    few, more = drawn(area, 3), drawn(area, 25)
    assert more[:3] == few
    assert len({mutant.key for mutant in more}) == len(more) == 25
    texts = {file: (ROOT / file).read_text(encoding="utf-8") for file in {mutant.file for mutant in more}}
    trees = {file: ast.dump(ast.parse(text)) for file, text in texts.items()}
    for mutant in more:
        text = texts[mutant.file]
        changed = mutant.of(text)
        assert ast.dump(ast.parse(changed)) != trees[mutant.file], mutant.key
        assert sum(a != b for a, b in zip(text.splitlines(), changed.splitlines(), strict=True)) == 1


def test_a_mutant_of_another_source_is_refused() -> None:
    (mutant,) = drawn("judge", 1)
    with pytest.raises(ValueError, match="the source is another one"):
        mutant.of("\n" * mutant.line)


def test_tests_are_those_of_the_module_and_of_its_room() -> None:
    assert "tests/sensitivity/test_least_time.py" in room_of("planner/sensitivity/straight_time.py")[:3]
    found = room_of("planner/verifier/matching.py")
    assert all(name.startswith("tests/verifier/") for name in found[:5])  # none of them names it
    assert all(name.startswith("tests/") for name in found)


SOURCE = "LIMIT = 2\n\n\ndef less(a, b):\n    if (\n        a\n        < b\n    ):\n        return 1\n    return LIMIT\n"


def test_lines_of_a_statement() -> None:
    assert statement(SOURCE, 1) == (range(1, 2), False)
    assert statement(SOURCE, 6) == statement(SOURCE, 5) == (range(5, 9), True)
    assert statement(SOURCE, 9) == (range(9, 10), True)


def test_tests_of_a_line(tmp_path: Path) -> None:
    """Those that run it, of the room first and then the shortest, as long as there is time; all of the room for what importing runs."""
    (tmp_path / "a.py").write_text(SOURCE)
    for name in ("t.py", "other.py"):
        (tmp_path / name).write_text("")
    seconds = {"t.py::long": BUDGET, "t.py::short": 0.1, "other.py::first": 0.1, "other.py::second": 0.2}
    lines = {1: [], 4: [], 5: ["t.py::long", "other.py"], 9: ["t.py::short", "t.py::long"]}
    digests = {name: digest(tmp_path / name) for name in ("a.py", "t.py", "other.py")}
    known = Covered({"a.py": lines}, seconds, digests)

    def tests(line: int) -> list[str]:
        return known.tests_of(tmp_path, "a.py", line, ["t.py"])

    assert tests(9) == ["t.py::short"]
    assert tests(7) == ["t.py::long"]  # it alone takes all the time
    assert tests(10) == []  # no test runs it
    assert tests(1) == ["t.py::short"]
    (tmp_path / "t.py").write_text("# changed\n")
    assert tests(7) == ["t.py", "other.py::first", "other.py::second"]
    known.write(tmp_path / "build" / "known.json")
    (tmp_path / "t.py").write_text("")
    compiled = SOURCE.replace("def ", "@njit\ndef ")
    (tmp_path / "a.py").write_text(compiled)
    of_kernels = Covered({"a.py": lines}, seconds, digests | {"a.py": digest(tmp_path / "a.py")})
    assert of_kernels.tests_of(tmp_path, "a.py", 10, ["t.py"]) == ["t.py::short"]  # all, for what is compiled
    assert Covered.read(tmp_path / "build" / "known.json") == known


TRIED = """
import json
import sys
from pathlib import Path
from benchmarks.mutants import trial
from benchmarks.mutants.draw import Mutant
trial.CPU = 2
found = []
for new in sys.argv[2:]:
    mutant = Mutant(area="judge", file="summed.py", line=7, column=12, old=" + ", new=new)
    became, by, *_ = trial.outcome(mutant, Path(sys.argv[1]), ["tests/test_summed.py"], {"test_summed.py::test_broken"})
    found.append((became, repr(by), (Path(sys.argv[1]) / "summed.py").read_text()))
print(json.dumps(found))
"""
SUMMED = "def forever():\n    while True:\n        pass\n\n\ndef total(a, b):\n    return a + b\n"
BECAME = {" - ": KILLED, " + 0 * ": KILLED, " + 0 + ": SURVIVED, " + forever() + ": NO_END}


@pytest.fixture(scope="module")
def tried(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, str, str]]:
    """What became of each mutant, by which test, and the source afterwards; all in one process, which takes seconds to start."""
    folder = tmp_path_factory.mktemp("copy")
    (folder / "summed.py").write_text(SUMMED)
    (folder / "tests").mkdir()
    (folder / "tests" / "test_summed.py").write_text(
        "from summed import total\n\ndef test_total():\n    assert total(2, 3) == 5\n\ndef test_broken():\n    assert False\n"
    )
    (folder / "pytest.ini").write_text("[pytest]\nmarkers = slow\n")
    done = subprocess.run(  # it forks, which is not for a process that has threads
        [sys.executable, "-c", TRIED, str(folder), *BECAME],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stderr
    return dict(zip(BECAME, map(tuple, json.loads(done.stdout.splitlines()[-1])), strict=True))


@pytest.mark.slow
@pytest.mark.parametrize(("new", "expected"), BECAME.items())
def test_what_becomes_of_a_mutant(tried: dict[str, tuple[str, str, str]], new: str, expected: str) -> None:
    """In a process of its own, which leaves this one and the copy as they were. Tests that fail without it can be left out."""
    became, by, source = tried[new]
    assert became == expected
    assert ("test_summed.py::test_total" in by) == (expected == KILLED)
    assert source == SUMMED


def test_shares_leave_out_mutants_that_change_nothing() -> None:
    rows = [
        {"area": "judge", "key": str(n), "became": became}
        for n, became in enumerate((KILLED, NO_END, SURVIVED))
    ]
    assert counts(rows)[-1] == ["all", "3", "1", "1", "0", "0", "1", "33.3 %"]
    for key, found in reasons().items():
        shown = {
            SAME: ["0", "1", "1", "33.3 %"],
            ELSEWHERE: ["1", "0", "1", "25.0 %"],
            OPEN: ["0", "0", "2", "50.0 %"],
        }
        assert counts([*rows, rows[2] | {"key": key}])[-1][4:] == shown[found["kind"]]


def test_reasons_are_of_mutants_that_survived() -> None:
    assert {found["kind"] for found in reasons().values()} <= {SAME, ELSEWHERE, OPEN}
    assert all(found["why"] for found in reasons().values())
