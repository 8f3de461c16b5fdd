"""Machine files: what is wrong in them is named, with the file, and the template has every key."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import planner
from planner.base.errors import InputError
from planner.controls.machine_import.linuxcnc import settings
from planner.machine import Machine, builtin_text, load_machine

TEMPLATE = Path(planner.__file__).parent / "templates" / "machine.toml"


def with_line(old: str, new: str) -> str:
    text = TEMPLATE.read_text()
    assert old in text
    return text.replace(old, new, 1)


def refusal(path: Path) -> str:
    """What is said of a machine file that is not taken."""
    with pytest.raises(InputError) as caught:
        load_machine(path)
    told = str(caught.value)
    assert told.startswith(f"{path}: ")
    return told


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (None, "machine file not found"),
        ("name = ", "not valid TOML"),
        ("G21\nG0 X1\n", "an NC program, where a machine file is needed"),
        ("M201 X3000 Y3000\n", "planner machine import"),
        ("[printer]\nkinematics: corexy\n[gcode_macro A]\ngcode:\n  G28\n", "planner machine import"),
        ('dt = 0,001\n[macros]\nM6 = "CHANGE"\n', "decimals have a point: 0.001"),
        ("name = 'a'\nx.velocity = 3,5\n", "decimals have a point: 3.5"),
        ("", "name: missing"),
        (
            with_line("[axes.y]\nvelocity = 500.0\nacceleration = 4000.0\njerk = 100000.0\n", ""),
            "axis 'y' is missing",
        ),
        (with_line("velocity = 500.0", "velocity = 0.0"), "axes.x.velocity"),
        (with_line("velocity = 500.0", "velocity = -1.0"), "axes.x.velocity"),
        (with_line("velocity = 500.0", "velocity = nan"), "axes.x.velocity"),
        (with_line("jerk = 100000.0", "jerk = inf"), "axes.x.jerk"),
        (with_line("jerk = 100000.0", ""), "axes.x.jerk: missing"),
        (with_line("tolerance = 0.02", "tolerance = 0"), "tolerance"),
        (with_line("tolerance = 0.02", "tolerance = 'thin'"), "tolerance"),
        (with_line("dt = 0.001", "dt = 0.001\nspeed = 3"), "speed: unknown key"),
        (with_line("[axes.z]", "[axes.q]"), "axis 'q' is not known"),
        (with_line('path_control = "blend"', 'path_control = "round"'), "path_control"),
        (TEMPLATE.read_text() + "[positions.g99]\nx = 1\n", "'g99' is not known"),
        (TEMPLATE.read_text() + "[tools]\nlong = 1\n", "not a tool number"),
    ],
)
def test_what_is_wrong_is_named(tmp_path: Path, content: str | None, said: str) -> None:
    path = tmp_path / "machine.toml"
    if content is not None:
        path.write_text(content)
    assert said in refusal(path)


def test_all_faults_are_named_at_once(tmp_path: Path) -> None:
    path = tmp_path / "machine.toml"
    path.write_text(with_line("velocity = 500.0", "velocity = 0.0").replace("dt = 0.001", "dt = -1"))
    assert "axes.x.velocity" in refusal(path)
    assert "dt" in refusal(path)


def test_a_machine_file_as_editors_of_windows_write_it(tmp_path: Path) -> None:
    (tmp_path / "machine.toml").write_bytes(b"\xef\xbb\xbf" + TEMPLATE.read_bytes().replace(b"\n", b"\r\n"))
    assert load_machine(tmp_path / "machine.toml").axes == load_machine(TEMPLATE).axes


def test_a_machine_file_that_is_no_text(tmp_path: Path) -> None:
    (tmp_path / "machine.toml").write_bytes(b"\xff\xfe\x00\x00")
    assert "cannot be read" in refusal(tmp_path / "machine.toml")
    assert "this is a directory; give the machine file" in refusal(tmp_path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a = " + "[" * 100_000, "nested too deep"),
        ("dt = " + "1" * 5000, "a number has more than 4,300 digits"),
        ("[" + "a." * 200_000 + "a]\n", "nested too deep"),  # Python's reader takes minutes for it
        ("a." * 60 + "a = 1\n", "nested too deep"),
        ("# " + "a." * 600_000, "more than 1,000,000 bytes"),
        ("".join(f"[t{k}]\na = 1\n" for k in range(20_000)), "and 19,984 more"),
        (TEMPLATE.read_text() + f"{'k' * 5000} = 1\n", "kkk...: unknown key"),
        (TEMPLATE.read_text() + f"[axes.y]\nvelocity = '{'x' * 5000}'\n", "not valid TOML"),
        (TEMPLATE.read_text() + "[tools]\n" + "1" * 5000 + " = 1\n", "not a tool number"),
    ],
)
def test_machine_files_beyond_reason(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "machine.toml").write_text(text)
    told = refusal(tmp_path / "machine.toml")
    assert said in told
    assert len(told) < 1000


@pytest.mark.shows("machine-files", "exact: every key of the template is valid and every key is in it")
def test_every_key_of_the_template_is_valid_and_every_key_is_in_it(tmp_path: Path) -> None:
    """With all optional keys uncommented the file loads, and sets every field of the record."""
    text = re.sub(r"^# (?=\[|[\w.]+ = )", "", TEMPLATE.read_text(), flags=re.MULTILINE)
    # the optional keys of the top level stand before the first table, as TOML demands
    (tmp_path / "full.toml").write_text(text)
    machine = load_machine(tmp_path / "full.toml")
    assert machine.model_fields_set == set(type(machine).model_fields)
    assert machine.fir is not None
    assert machine.fir.phase_lag_max == 30.0
    assert "a" in machine.axes
    assert machine.work_offsets["g55"]["x"] == 120.0


# What the sources of the machines that are products say: LinuxCNC in inch/s and inch/s2, grbl in mm/min, the others in mm/s.
SOURCED = {
    "tormach": ([1.5 * 25.4, 1.5 * 25.4, 1.083 * 25.4], [9 * 25.4, 9 * 25.4, 6 * 25.4]),
    "boss": ([2 * 25.4] * 3, [10 * 25.4] * 3),
    "shapeoko": ([5000 / 60] * 3, [400.0] * 3),
    "voron": ([300.0, 300.0, 15.0], [3000.0, 3000.0, 350.0]),
    "ender3": ([500.0, 500.0, 5.0], [500.0, 500.0, 100.0]),
}


@pytest.mark.parametrize("name", SOURCED)
def test_built_in_products_have_the_figures_of_their_sources(name: str) -> None:
    machine = load_machine(name)
    velocity, acceleration = SOURCED[name]
    assert machine.limits("velocity", ("x", "y", "z")) == pytest.approx(velocity, rel=1e-4)
    assert machine.limits("acceleration", ("x", "y", "z")) == pytest.approx(acceleration, rel=1e-6)
    text = builtin_text(name)
    assert "github.com/" in text
    assert text.count("assumed") + text.count("Assumed") >= 3


INI = Path("/usr/share/doc/linuxcnc/examples/sample-configs/by_machine")


@pytest.mark.shows("machine-files", "compared: LinuxCNC's own configurations, where they are installed")
@pytest.mark.parametrize(
    ("name", "file"), [("tormach", "tormach/pcnc-1100-seriesII.ini"), ("boss", "boss/boss.ini")]
)
def test_linuxcncs_own_configurations_say_the_same(name: str, file: str) -> None:
    if not (INI / file).exists():
        pytest.skip(f"{INI / file} (package linuxcnc-doc or linuxcnc-uspace) is not installed")
    said = settings((INI / file).read_text(encoding="utf-8"), file)
    machine = load_machine(name)
    for letter in ("x", "y", "z"):
        assert machine.axes[letter].velocity == pytest.approx(said.velocity[letter].value, rel=1e-4)
        assert machine.axes[letter].acceleration == pytest.approx(said.acceleration[letter].value)
    assert said.dt is not None
    assert machine.dt == pytest.approx(said.dt.value)
    assert said.feed_max is not None
    assert machine.feed_max == pytest.approx(said.feed_max.value)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("dt", 5e-324, "dt: must be of a magnitude between 1e-12 and 1e+12, found 4.94066e-324"),
        ("tolerance", 1e300, "tolerance: must be of a magnitude between 1e-05 and 1e+12, found 1e+300"),
        ("velocity", 1e12, "axes.x.velocity: must be of a magnitude between 1e-12 and 1e+09, found 1e+12"),
        ("jerk", 1e13, "axes.x.jerk: must be of a magnitude between 1e-12 and 1e+12, found 1e+13"),
        ("length", -1e300, "tools.1.length: must be of a magnitude between 1e-12 and 1e+12, found -1e+300"),
    ],
)
def test_numbers_that_no_machine_has(key: str, value: float, said: str) -> None:
    """Found by benchmarks/fuzz: their powers are no numbers, and ended as a bug."""
    axis = {"velocity": 1.0, "acceleration": 1.0, "jerk": 1.0}
    of_x = {name: value if name == key else each for name, each in axis.items()}
    top = {"dt": 0.001, "tolerance": 0.01} | ({key: value} if key in ("dt", "tolerance") else {})
    tools = {"1": {"length": value}} if key == "length" else {}
    with pytest.raises(InputError) as caught:
        planner.Machine(name="m", axes={"x": of_x, "y": axis}, tools=tools, **top)
    assert str(caught.value) == said


def test_faults_are_told_in_the_words_of_the_file() -> None:
    axis = {"velocity": 1.0, "acceleration": 1.0, "jerk": 1.0}
    bad = {
        "name": 3,
        "dt": -1,
        "tolerance": "thin",
        "axes": {"x": axis, "y": {**axis, "jerk": "inf"}},
        "speed": 2,
    }
    with pytest.raises(InputError) as caught:
        planner.Machine(**bad)
    assert str(caught.value).split("; ") == [
        "name: must be a text, found 3",
        "dt: must be above 0, found -1",
        "tolerance: must be a number, found 'thin'",
        "axes.y.jerk: must be a finite number, found 'inf'",
        "speed: unknown key",
    ]
    machine = load_machine("mill")
    with pytest.raises(
        AttributeError, match=r"Machine.dt cannot be set: .*model_copy\(update=\{'dt': 0.002\}\)"
    ):
        machine.dt = 0.002  # type: ignore[misc]
    assert machine.model_copy(update={"dt": 0.002}).dt == 0.002


@pytest.mark.parametrize("name", ["ender3", "voron"])
def test_built_in_printers_have_an_extruder(name: str) -> None:
    text = "G21\nG90\nM82\nG92 E0\nG1 X30 F3000\nG1 X60 E2 F1200\nG1 E-1 F1500\nG1 X0\n"
    program = planner.read_program(text=text, machine=name)
    assert program.extruded.tolist() == [0.0, 2.0, -3.0, 0.0]
    assert not [said for said in program.assumptions if "E word" in said]


def test_a_machine_in_one_line_has_the_limits_of_its_axes() -> None:
    machine = Machine.of("xyc", [500.0, 400.0, 90.0], 4000.0, 100_000.0, tolerance=0.05)
    assert [machine.axes[letter].velocity for letter in "xyc"] == [500.0, 400.0, 90.0]
    assert {axis.acceleration for axis in machine.axes.values()} == {4000.0}
    assert (machine.tolerance, machine.dt, machine.name) == (0.05, 0.001, "machine")


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (("xy", [1.0, 2.0, 3.0], 1.0, 1.0), "velocity: 3 limits for the axes 'xy'"),
        (("xx", 1.0, 1.0, 1.0), "give each letter once"),
        (("xy", -1.0, 1.0, 1.0), "velocity: must be above 0"),
        (("x", 1.0, 1.0, 1.0), "axis 'y' is missing"),
    ],
)
def test_a_machine_in_one_line_says_what_is_wrong(given: tuple, said: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(InputError, match=said):
        Machine.of(*given)
