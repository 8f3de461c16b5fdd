"""A page of a folder whose files are not those of a plan any more: refused with the file and the key (found by benchmarks/fuzz)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import planner
from planner.base.errors import InputError
from planner.report.export import write_plan
from planner.report.html.page import report_page
from planner.report.html.saved import saved_plan


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plan with its trajectory in CSV, so that the metadata are a file."""
    place = tmp_path_factory.mktemp("saved")
    (place / "job.ngc").write_text("G21 G90 F600\nG1 X3\nY2\n")
    write_plan(planner.plan(place / "job.ngc", "mill", method="stop"), place / "out", file_format="csv")
    return place / "out"


def with_changes(folder: Path, tmp_path: Path, file: str, **changes: Any) -> Path:
    """A copy of a folder, with some values of one of its JSON files changed."""
    copy = tmp_path / "copy"
    copy.mkdir()
    for path in folder.iterdir():
        (copy / path.name).write_bytes(path.read_bytes())
    said = json.loads((copy / file).read_text())
    (copy / file).write_text(json.dumps({**said, **changes}))
    return copy


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("program", ["a"]),
        ("status", "WELL"),
        ("status", True),
        ("blocks", "3"),
        ("grid_points", None),
        ("notes", 1.5),
        ("notes", [1]),
        ("timings_s", {"read": {}}),
        ("stop_time_s", []),
    ],
)
def test_a_summary_of_other_kinds_is_refused(folder: Path, tmp_path: Path, key: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"summary.json: no summary of a plan: {key} is "):
        saved_plan(with_changes(folder, tmp_path, "summary.json", **{key: value}))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("machine", None),
        ("machine", []),
        ("tolerance_mm", "thin"),
        ("tolerance_mm", -1),
        ("not_limited", 3.0),
        ("not_limited", ["x"]),
    ],
)
def test_metadata_of_other_kinds_are_refused(folder: Path, tmp_path: Path, key: str, value: object) -> None:
    with pytest.raises(InputError, match=rf"trajectory.csv: its metadata are not those of a plan: {key} is "):
        saved_plan(with_changes(folder, tmp_path, "trajectory.meta.json", **{key: value}))


def test_numbers_that_json_has_not_become_null(folder: Path, tmp_path: Path) -> None:
    """Python reads NaN and 1e999 in JSON, and a browser does not."""
    plan, summary = saved_plan(with_changes(folder, tmp_path, "summary.json", cycle_time_s=float("nan")))
    assert summary["cycle_time_s"] is None
    assert "NaN" not in report_page(plan, summary).partition('id="about">')[2].partition("</script>")[0]


def test_a_tolerance_beyond_all_coordinates_is_refused(folder: Path, tmp_path: Path) -> None:
    """Its square is no number."""
    with pytest.raises(InputError, match=r"tolerance 1e\+308 mm; it must be between 1e-05 and 1e\+07"):
        saved_plan(with_changes(folder, tmp_path, "trajectory.meta.json", tolerance_mm=1e308))
