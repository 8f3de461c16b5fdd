"""The registry of names: every name makes a method, every earlier name still does, and geometries are told from corner shapes."""

from __future__ import annotations

from pathlib import Path

import pytest
from hand_made import SQUARE
from typer.testing import CliRunner

import planner
from planner.base.errors import InputError
from planner.base.names import METHOD_ALIASES, METHODS, method_name, smoothing, users_of
from planner.cli import app
from planner.planning.methods.optimal import OptimalMethod
from planner.planning.methods.registry import make_method
from planner.planning.methods.second_order import SecondOrderMethod


@pytest.mark.parametrize("name", METHODS)
def test_every_name_makes_its_method(name: str) -> None:
    made = make_method(name)
    assert type(made).__name__ == METHODS[name].home.partition(":")[2]
    assert all(getattr(made, setting) == value for setting, value in METHODS[name].settings.items())


def test_every_method_has_the_solvers_and_settings_of_its_row() -> None:
    for name, entry in METHODS.items():
        for solver in entry.solvers:
            make_method(name, solver=solver)
        assert entry.shapes == (name in users_of("shaped")) == hasattr(make_method(name), "shaped")


def test_method_toppra_is_the_second_order_method() -> None:
    assert METHOD_ALIASES["toppra"] == method_name("toppra") == "second-order"
    assert make_method("toppra") == SecondOrderMethod(corner="auto", solver="reachability")
    assert make_method("toppra", solver="toppra") == SecondOrderMethod(solver="toppra")


@pytest.mark.parametrize(
    ("geometry", "corner", "found"),
    [
        (None, None, ("auto", None)),
        ("auto", None, ("auto", None)),
        ("spline", None, ("spline", None)),
        ("corners", None, ("corners", "bezier")),
        ("corners", "fir", ("corners", "fir")),
        (None, "kinematic", ("corners", "kinematic")),
        (None, "auto", ("auto", None)),  # as earlier versions had it
        (None, "spline", ("spline", None)),
        ("spline", "spline", ("spline", None)),
    ],
)
def test_geometry_and_corner(geometry: str | None, corner: str | None, found: tuple[str, str | None]) -> None:
    assert smoothing(geometry, corner) == found
    kind, shape = found
    assert make_method("optimal", geometry=geometry, corner=corner) == OptimalMethod(corner=shape or kind)


@pytest.mark.parametrize(
    ("geometry", "corner", "said"),
    [
        ("spline", "fir", "use geometry corners"),
        ("corners", "auto", "geometry = corners is another"),
        ("round", None, "no geometry 'round'; there are auto, spline, corners"),
        (None, "round", "no corner shape 'round'; there are bezier, fir, kinematic"),
    ],
)
def test_what_does_not_go_together_is_refused(geometry: str | None, corner: str | None, said: str) -> None:
    with pytest.raises(InputError, match=said):
        smoothing(geometry, corner)


def test_a_name_close_by_is_suggested() -> None:
    with pytest.raises(InputError, match=r"did you mean 'kinematic'\?"):
        method_name("kinematik")


@pytest.mark.parametrize(
    ("arguments", "method", "corner"),
    [
        (["--method", "toppra", "--corner", "bezier"], "second-order", "bezier"),
        (["--method", "toppra", "--solver", "toppra", "--corner", "bezier"], "second-order", "bezier"),
        (["--method", "second-order", "--geometry", "corners"], "second-order", "bezier"),
        (["--method", "second-order", "--corner", "spline"], "second-order", "spline"),
    ],
)
def test_command_lines_of_earlier_versions(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], method: str, corner: str
) -> None:
    """They reach the method that they used to; the method itself plans nothing here."""
    job = tmp_path / "square.ngc"
    job.write_text(SQUARE)
    seen: list[SecondOrderMethod] = []

    def refused(self: SecondOrderMethod, *_: object, **__: object) -> planner.Plan:
        seen.append(self)
        raise InputError("seen")

    monkeypatch.setattr(SecondOrderMethod, "plan", refused)
    result = CliRunner().invoke(app, ["plan", str(job), *arguments])
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (
        2,
        "seen",
    )  # after lines of progress, where kernels compile
    assert method_name(arguments[1]) == method
    assert seen[0].corner == corner
    assert seen[0].solver == (arguments[3] if arguments[2] == "--solver" else "reachability")
