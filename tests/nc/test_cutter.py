"""Cutter radius compensation: the tool's centre keeps the distance of its radius from the programmed path, by code of this file."""

from __future__ import annotations

import numpy as np
import pytest

from planner.base.errors import InputError
from planner.machine import Machine
from planner.nc.program import Kind, Program
from planner.nc.reader import parse_program

HEAD = "G21 G17 G90 F600 G0 X0 Y0\n"


def pieces(program: Program) -> list[tuple[Kind, complex, complex, complex, float]]:
    """Kind, start, end, centre and sweep of every move in the x y plane."""
    arc = {int(block): row for row, block in enumerate(program.arc_block)}
    found, start = [], complex(*program.start[:2])
    for block, (kind, end) in enumerate(zip(program.kind, program.end, strict=True)):
        end, row = complex(*end[:2]), arc.get(block)
        centre = complex(*program.arc_center[row][:2]) if row is not None else 0j
        found.append((Kind(kind), start, end, centre, program.arc_sweep[row] if row is not None else 0.0))
        start = end
    return found


def points(piece: tuple[Kind, complex, complex, complex, float], count: int = 40) -> np.ndarray:
    kind, start, end, centre, sweep = piece
    t = np.linspace(0.0, 1.0, count)
    return (
        start + t * (end - start) if kind != Kind.ARC else centre + (start - centre) * np.exp(1j * t * sweep)
    )


def distance(point: complex, piece: tuple[Kind, complex, complex, complex, float]) -> float:
    """From a point to a move, in closed form."""
    kind, start, end, centre, sweep = piece
    if kind != Kind.ARC:
        along = end - start
        t = 0.0 if along == 0 else ((point - start) * along.conjugate()).real / abs(along) ** 2
        return abs(point - start - min(max(t, 0.0), 1.0) * along)
    turn = np.angle((point - centre) / (start - centre)) * np.sign(sweep) % (2 * np.pi)
    if turn <= abs(sweep):
        return abs(abs(point - centre) - abs(start - centre))
    return min(abs(point - start), abs(point - end))


def star(rng: np.random.Generator, *, arcs: bool) -> list[str]:
    """Its first point and a closed path once round the origin, counter-clockwise, of lines and arcs, corners either way."""
    angle = np.sort((np.arange(9) + rng.uniform(-0.3, 0.3, 9)) * 2 * np.pi / 9)
    corner = rng.uniform(25.0, 40.0, 9) * np.exp(1j * angle)
    lines, last = [], corner[0]
    for end in [*corner[1:], corner[0]]:
        code, size = "G1", ""
        if arcs and rng.random() < 0.5:
            code, size = ("G2", "G3")[rng.integers(2)], f" R{abs(end - last) * rng.uniform(0.9, 2.0):.10f}"
        lines.append(f"{code} X{end.real:.10f} Y{end.imag:.10f}{size}")
        last = end
    return [f"X{corner[0].real:.10f} Y{corner[0].imag:.10f}", *lines]


@pytest.mark.shows("read-linuxcnc", "exact: positions worked out by hand, cutter compensation by geometry")
@pytest.mark.parametrize("arcs", [False, True])
@pytest.mark.parametrize("side", ["G41.1", "G42.1"])
@pytest.mark.parametrize(
    "seed", [0, 1, 3, 5]
)  # 2 and 4 have a turn of less than 0.05 rad, which is taken straight on
def test_the_centre_keeps_its_distance(seed: int, side: str, arcs: bool) -> None:
    path, radius = star(np.random.default_rng(seed), arcs=arcs), 0.8
    text = HEAD + "{}\nG1 " + "\n".join([*path, path[1], path[2]]) + "\n{}\nG0 X0 Y0\n"
    programmed = pieces(parse_program(text.format("", "")))[2:-1]
    compensated = parse_program(text.format(f"{side} D{2 * radius}", "G40"))
    # once round, without the moves that come from the first and lead to the last
    once = [
        piece for piece, line in zip(pieces(compensated), compensated.line, strict=True) if 5 <= line <= 13
    ]
    assert len(once) >= 9
    for piece in once:
        for point in points(piece):
            assert min(distance(point, other) for other in programmed) == pytest.approx(radius, abs=1e-9)


def test_the_side_is_the_side() -> None:
    left = parse_program(HEAD + "G41.1 D4\nG1 X20\nX40\nG40 X60\n")
    right = parse_program(HEAD + "G42.1 D4\nG1 X20\nX40\nG40 X60\n")
    assert left.end[1:3, 1].tolist() == [2.0, 2.0]
    assert right.end[1:3, 1].tolist() == [-2.0, -2.0]
    assert left.end[3].tolist() == right.end[3].tolist() == [60.0, 0.0, 0.0]


def mirrored(text: str) -> str:
    """In the y axis: the other sign of X and I, the other side, the other sense."""
    swap = {"G41.1": "G42.1", "G42.1": "G41.1", "G2": "G3", "G3": "G2"}
    words = (swap.get(word, word) for word in text.replace("\n", " \n ").split(" "))
    return " ".join(w[0] + str(-float(w[1:])) if w[:1] in ("X", "I") else w for w in words)


TEXT = HEAD + (
    "G41.1 D3\nG1 X20 Y10\nX40 Y12\nG3 X50 Y22 I0 J10\nG1 X45 Y40 Z2\nZ1\nG2 X30 Y30 R15\nG1 X22 Y45\nG40 X0 Y0\n"
)


def test_mirrored_programs_are_mirrored() -> None:
    one, other = parse_program(TEXT), parse_program(mirrored(TEXT))
    assert (one.kind == other.kind).all()
    np.testing.assert_allclose(other.end, one.end * [-1, 1, 1], atol=1e-9)
    np.testing.assert_allclose(other.arc_sweep, -one.arc_sweep, atol=1e-9)


@pytest.mark.parametrize("angle", [30.0, 90.0, -135.0])
def test_rotated_systems_rotate_the_tool_path(angle: float) -> None:
    plain, rotated = parse_program(TEXT), parse_program(f"G10 L2 P1 R{angle}\n" + TEXT)
    turn = np.exp(1j * np.deg2rad(angle))
    before, after = plain.end[:, 0] + 1j * plain.end[:, 1], rotated.end[:, 0] + 1j * rotated.end[:, 1]
    np.testing.assert_allclose(after, before * turn, atol=1e-9)
    np.testing.assert_allclose(rotated.arc_sweep, plain.arc_sweep, atol=1e-9)


def test_lathe_plane_is_the_other_plane() -> None:
    """G18 with (z, x) for (x, y) is the same path."""
    swap = str.maketrans({"X": "Z", "Y": "X", "Z": "Y", "I": "K", "J": "I"})
    flat, turned = parse_program(TEXT), parse_program(TEXT.translate(swap).replace("G17", "G18"))
    np.testing.assert_allclose(turned.end[:, [2, 0, 1]], flat.end, atol=1e-9)
    assert (turned.arc_normal == 1).all()


def test_tools_have_diameters() -> None:
    tools = {"1": {"length": 5.0, "diameter": 4.0}, "2": 7.0}
    machine = Machine(
        name="m", dt=1e-3, tolerance=0.01, tools=tools,
        axes={a: {"velocity": 1, "acceleration": 1, "jerk": 1} for a in "xyz"},
    )  # type: ignore[arg-type] # fmt: skip
    path = "\nG1 X20\nX40\nG40 X60\n"
    by_number = parse_program(HEAD + "T1 M6\nG41 D1" + path, machine)
    loaded = parse_program(HEAD + "T1 M6\nG41" + path, machine)
    direct = parse_program(HEAD + "T1 M6\nG41.1 D4" + path, machine)
    inch = parse_program(HEAD + "T1 M6\nG10 L1 P1 R2\nG41 D1" + path, machine)
    for program in (by_number, loaded, inch):
        np.testing.assert_array_equal(program.end, direct.end)
    none = parse_program(HEAD + "G41 D2" + path, machine)
    assert none.end[:, 1].tolist() == [0.0, 0.0, 0.0, 0.0]
    assert "tool 2 has no diameter" in none.notes[0]


REFUSED = [
    ("G41.1 D4\nG1 X1", 3, "longer than the tool's radius, 2 mm"),
    ("G41.1 D4\nG1 Z1", 3, "does not move in its plane"),
    ("G41.1 D4\nG1 X20\nX30\nX29.5 Y1\nX0", 6, "would gouge"),
    ("G41.1 D4\nG1 X20\nG3 X20 Y3 J1.5", 4, "1.5 mm, must be larger than the tool's, 2 mm"),
    ("G41.1 D40\nG3 X20 Y0 I10", 3, "must be larger than the tool's, 20 mm"),
    ("G41.1 D4\nG1 X20\nX40\nG40\nG2 X50 I5", 6, "must be straight"),
    ("G41.1\nG1 X20", 2, "needs the tool's diameter"),
    ("G41.1 D4\nG42.1 D4", 3, "write G40 before it"),
    ("G19 G41.1 D4", 2, "y z plane is not supported"),
    *[
        (f"G41.1 D4\nG1 X20\n{code}", 4, "while cutter radius compensation is on; write G40 before it")
        for code in ("G18", "G55", "G43 H1", "G49", "G28", "G28.1", "G92 X1", "G52 X1", "G61", "G98", "T1 M6", "G53 G1 X3")
    ],
    ("S1 M3 G41.1 D4\nG1 X20\nG81 X30 Z-1 R1", 4, "G81 while cutter radius compensation is on"),
    ("G41.1 D4\nG1 X20\nG10 L2 P1 X3", 4, "G10 while"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "line", "part"), REFUSED, ids=lambda v: str(v)[:40])
def test_refused(text: str, line: int, part: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_program(HEAD + text + "\nM2\n")
    assert caught.value.line == line
    assert part in caught.value.message


def test_a_program_that_just_ends_is_looked_at_too() -> None:
    """The last move is settled without M2 as well."""
    with pytest.raises(InputError, match="gouge"):
        parse_program(HEAD + "G41.1 D4\nG1 X20\nX30\nX29.5 Y1")


def test_back_before_an_arc_with_the_tool_inside_goes_round_the_corner() -> None:
    """And with the tool outside, both moves end where they meet: a line at y = -1 and a circle of radius 6 about (20, -5)."""
    path = "G1 X10\nX20\nG3 X15 Y-5 I0 J-5\nG40\n"
    inside = parse_program(HEAD + "G41.1 D2\n" + path)
    assert inside.arc_sweep == pytest.approx([-np.pi, np.pi / 2])
    assert inside.end[-2:, :2] == pytest.approx(np.array([[20.0, -1.0], [16.0, -5.0]]))
    outside = parse_program(HEAD + "G42.1 D2\n" + path)
    assert len(outside.arc_sweep) == 1
    assert outside.end[-2, :2] == pytest.approx([20.0 - np.sqrt(36.0 - 16.0), -1.0])


def test_straight_on_an_arc_begins_before_its_programmed_start() -> None:
    """By about the turn times r / R: 0.04 rad away from the tool, r = 2, R = 3 - 2."""
    turn, start = 0.04, 20.0 + 0.0j
    centre = start - 3j * np.exp(1j * turn)
    end = centre + (start - centre) * np.exp(-0.5j * np.pi)
    arc = f"G2 X{end.real:.12f} Y{end.imag:.12f} I{(centre - start).real:.12f} J{(centre - start).imag:.12f}\nG40\n"
    program = parse_program(HEAD + "G42.1 D4\nG1 X10\nX20\n" + arc)
    assert program.end[-2, :2] == pytest.approx([20.0, -2.0])
    early = np.arctan2(3 * np.sin(turn), 3 * np.cos(turn) - 2) - turn
    assert -program.arc_sweep[0] == pytest.approx(np.pi / 2 + early, abs=1e-9)
