"""What an installation brings along, on machines that there are no wheels of everything for."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path

import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# Where all packages but these have wheels (asked of the package index for Python 3.11 and 3.13).
WITHOUT_WHEELS = {
    ("linux", "x86_64"): set(),
    ("linux", "aarch64"): {"toppra"},
    ("win32", "AMD64"): {"toppra"},
    ("darwin", "arm64"): {"toppra"},
    ("darwin", "x86_64"): {"toppra"},
}


@pytest.mark.parametrize("machine", WITHOUT_WHEELS, ids=" ".join)
def test_an_installation_asks_for_what_there_are_wheels_of(machine: tuple[str, str]) -> None:
    here = {"sys_platform": machine[0], "platform_machine": machine[1]}
    wanted = [Requirement(one) for one in PROJECT["dependencies"]]
    missing = {one.name for one in wanted if one.marker and not one.marker.evaluate(here)}
    assert missing == WITHOUT_WHEELS[machine]


@pytest.mark.parametrize("package", ["toppra", "ruckig"])
def test_what_tests_are_skipped_without_is_installed_where_there_are_wheels(package: str) -> None:
    wanted = [*PROJECT["dependencies"], *PROJECT["optional-dependencies"]["test"]]
    (one,) = (one for one in map(Requirement, wanted) if one.name == package)
    assert one.marker
    if not one.marker.evaluate():
        pytest.skip(f"no wheel of {package} for this machine")
    assert importlib.util.find_spec(package)


def test_what_may_be_missing_can_be_asked_for() -> None:
    (extra,) = PROJECT["optional-dependencies"]["toppra"]
    (wanted,) = (one for one in map(Requirement, PROJECT["dependencies"]) if one.name == "toppra")
    assert Requirement(extra).name == "toppra"
    assert wanted.specifier == Requirement(extra).specifier


def test_packages_that_may_be_missing_are_imported_with_a_sentence() -> None:
    """Never by a plain import, which would end in a traceback."""
    plain = re.compile(r"^\s*(import|from) (toppra|casadi)\b", re.MULTILINE)
    for file in (ROOT / "planner").rglob("*.py"):
        assert not plain.search(file.read_text(encoding="utf-8")), file
