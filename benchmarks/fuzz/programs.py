"""Fuzzing of NC programs of all dialects, among them those of 3-D printers.

Programs are pieces of those in the shared folder and of a list of constructs, with lines, words and bytes changed, doubled, swapped
and cut; they are read with settings by chance, and on no machine, one with nine axes and an extruder, a lathe, or one of those that
come with the package. Each must end in a program or in messages that say a place.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fuzz.run import Place

ROOT = Path(__file__).resolve().parents[2]
NOTES_MAX = 200
LONG_LINE = 10_000  # bytes: a longer line (a plotter file can be one) is not doubled
PIECE = 60  # lines of a program that are mutated together
LINES_MAX = 3 * PIECE  # of a kept program that is mutated further
ENDINGS = (
    "nc",
    "ngc",
    "gcode",
    "h",
    "mpf",
    "plt",
)  # the name counts where the text does not tell the dialect
INFO = 0.1  # of the programs that are read, how many the command `info` gets too

CONSTRUCTS = """\
%\nO1000 (NAME)\nG21 G90 G17 G94\nG0 X1 Y2 Z3\nG1 X5 F600\nG2 X7 I1 J0\nG3 X7 Y1 R2\nG3 I5 P2 Z1
G28 X Y\nG28 G91 Z0\nG92 X0\nG92.1\nG10 L2 P1 X5 R30\nG10 L20 P1 X0\nG52 X1\nG43 H1\nG49\nG53 G0 X1\nG4 P0.1\nG4 S1\nG64 P0.01
G81 X1 Z-1 R1\nG83 X2 Z-5 R1 Q1 L3\nG80\nG76 P1 Z-5 I-.1 J.1 K.5 Q29 E.1 L1\nG33 Z-1 K1\nG41 D1\nG40\nG5 I1 J1 P1 Q1 X5 Y5\nG5.1 Q1
G5.2 P1 X1 Y1 L3\nG5.3\nG93\nG95\nG96 D1500 S200\nG7\nG8\nG18\nG19\nG20\nG90.1\nG91.1\nM3 S100 $1\nM98 P1000 L2\nM99\nG65 P1000 A1 B2
M104 S200\nM109 S210\nM82\nM83\nG1 X1 E0.5\nG92 E0\nM117 hello world\nM201 X500 Y500\nM84 X Y E\n$H\n$X\n$100=5\n$J=G91X1\nM428
M6 T1\nT2 M6 G43 H2\nM0\nM1\nM30\nM2\nM60\nM62 P1\nM66 P0 L3\nA0. B0\nG1 X5 A90.\n#1=5\n#<a>=[1+2*3]\nX#1 Y[#<a>]\no100 sub\no100 endsub
o100 call [1] [2]\no101 if [#1 GT 2]\no101 else\no101 endif\no102 while [#1 LT 5]\n#1=[#1+1]\no102 endwhile\no103 repeat [3]
o103 endrepeat\nIF [#1 EQ 5] GOTO 10\nN10\nWHILE [#1 LT 5] DO 1\nEND 1\nX1e-05 Y-8.775e-05\n(comment)\n; comment\n/G0 X5
BEGIN PGM 1 MM\nL X+5 Y+2 FMAX\nDEF REAL A\nCYCLE800()\nIN;PU0,0;PD400,0;PD400,400;\nAA0,0,90;\nRT1,2,3,4;\nSP1;ZZ5;\nSC0,1,0,1;
G90 U-2. Z-9 R1 F9\nX3\nG74 R.1\nG74 X3 Z-4 P500 Q900 R.2\nG75 U-3 I1.\nG92 X3 Z-4 F1.\nG94 X0 Z-1\nG10 L20 P3 X1
G71 U2. R0.5\nG71 P10 Q20 U0.5 W0.1 F0.2\nN10 G0 X20\nN20 X40 Z-20\nG70 P10 Q20\nG72 P10 Q20 D1. U0 W.1
G73 P10 Q20 I2. K1. D3\nG0 U2 W-1\nG99
G76 P010060 Q50 R0.02\nG76 X16.9 Z-25. P1534 Q485 F2.5\nG32 Z-5 F1.\nG96 S200\nG50 S3000\nT0101\nG54.1 P3\nG33.1 Z-5 K1
CYCL DEF 200 Q200=2 Q201=-5 Q206=100 Q202=2 Q203=0 Q204=10 Q211=0\nCYCL CALL\nCC X+1 Y+1\nC X+5 Y+1 DR+\nRND R2\nLBL 1\nCALL LBL 1 REP 3
LBL 0\nQ1 = Q2 + 3\nFN 9: IF +Q1 EQU +Q2 GOTO LBL 1\nCP IPA+360 DR+\nTOOL CALL 1 Z S1000 F100\nEND PGM 1 MM
MCALL CYCLE81(5,0,2,-5)\nMCALL\nFOR I=1 TO 5\nENDFOR\nLOOP\nENDLOOP\nIF R1==1 GOTOF ENDE\nENDE:\nX=IC(2) Y=AC(3)\nR1=R1+1\nTRANS X5
HOLE P3\nCALL "A"\nPROC B(REAL C)\nRET\nREPEAT\nUNTIL R1>3\nREPEAT ENDE P=2
L X+0 Y+0 RL F500\nL X+9 R0\nL X+5 Y+5 RR\nAPPR LCT X+5 Y+5 R5 RL F100\nAPPR CT X+1 Y+2 Z-3 CCA90 R+4 RR\nDEP LT LEN5\nDEP LCT X+9 R2 F9
CYCL DEF 8.0\nCYCL DEF 8.1 X\nCYCL DEF 10.1 ROT+30\nCYCL DEF 11.1 SCL 2\nCYCL DEF 26.1 X2 CCX+1\nTRANS DATUM AXIS X+5\nTRANS DATUM RESET
CYCL DEF 203 Q200=2 Q201=-9 Q206=100 Q202=4 Q212=1 Q205=1 Q213=2\nCYCL DEF 207 Q200=2 Q201=-5 Q239=1\nCALL PGM other.h
CYCL DEF 251 Q215=0 Q218=30 Q219=20 Q220=4 Q207=500 Q201=-5 Q202=2 Q206=100 Q200=2 Q368=.1 Q370=1
CYCL DEF 208 Q335=9 Q334=1 Q201=-3 Q206=90
CYCL DEF 220 Q216=5 Q217=5 Q244=20 Q246=360 Q241=4\nCYCL DEF 221 Q237=5 Q238=5 Q242=3 Q243=2
CYCL DEF 254 Q375=40 Q219=9 Q248=50 Q201=-2
ROT RPL=30\nMIRROR X0\nASCALE X2 Y2\nATRANS X1\nG41 X5 Y5\nG42\nG40 X0\nG1 X5 RND=2\nX9 CHR=1
CT X5 Y5\nCIP X5 Y5 I1=3 J1=1\nREPEATB A P=2
CYCLE84(9,0,2,-5,,0,3,8,,0,300)\nCYCLE86(9,0,2,-5,,1,3,1,1,1,0)\nPOCKET3(9,0,2,-5,40,30,6,0,0,0,2,.1,.1,500,100,0,11)\nPOCKET4(9,0,2,-5,20,0,0,2,0,0,500,100,1,21,,,,1,1)
<!-- a -->\n<svg>\n@PJL SET A=B\n\x1b.@;\n999
0\nSECTION\nsolid a\nfacet normal 0 0 1\nG0 X1 (open\nG0 X--1\nG1 X1..2\nG999 X1\nM-3\nS-5\nF0\nX99999999999\nG187 P1\nM73 P1 R70
""".splitlines()
_BYTES = b'GMXYZIJKRPQFSTNHDEABCUVWLO0123456789.+-#[]()<>=%/$:;,* \t\n\r"\x00\x80\xff\x1b'


def mutant(rng: np.random.Generator, programs: list[list[bytes]], start: bytes | None = None) -> bytes:
    """A mutated program, from `start` or a piece of one of the programs or of the constructs."""
    lines = _piece(rng, programs) if start is None else start.splitlines()[:LINES_MAX] or [b""]
    for _ in range(int(rng.integers(1, 8))):
        k, other = (int(v) for v in rng.integers(0, len(lines), 2))
        change = int(rng.integers(0, 9))
        if change == 0:
            lines.insert(k, CONSTRUCTS[int(rng.integers(0, len(CONSTRUCTS)))].encode())
        elif change == 1:
            lines[k], lines[other] = lines[other], lines[k]
        elif change == 2:
            lines[k] += b" " + lines[other]
        elif change == 3 and len(lines[k]) < LONG_LINE:
            lines[k] = lines[k] * int(rng.integers(2, 5))
        elif change == 4 and len(lines) > 2:
            del lines[k]
        elif change == 5:
            lines[k] = lines[k][: int(rng.integers(0, len(lines[k]) + 1))]
        else:
            lines[k] = _changed(rng, lines[k])
    return rng.choice([b"\n", b"\r\n"]).join(lines) if rng.random() < 0.95 else b" ".join(lines)


def _piece(rng: np.random.Generator, programs: list[list[bytes]]) -> list[bytes]:
    count = int(rng.integers(1, PIECE))
    if programs and rng.random() < 0.6:
        lines = programs[int(rng.integers(0, len(programs)))]
        first = int(rng.integers(0, max(len(lines) - count, 0) + 1)) * int(rng.integers(0, 2))
        return list(lines[first : first + count]) or [b"G0"]
    few = 1 + count // 8  # most of them are refused somewhere
    return [CONSTRUCTS[k].encode() for k in rng.integers(0, len(CONSTRUCTS), few)]


def _changed(rng: np.random.Generator, line: bytes) -> bytes:
    at = int(rng.integers(0, len(line) + 1))
    new = bytes(rng.choice(list(_BYTES), size=int(rng.integers(0, 4))).tolist())
    return line[:at] + new + line[at + int(rng.integers(0, 3)) :]


def make_program(rng: np.random.Generator, start: bytes | None, _: Place) -> bytes:
    """A program: `start` with changes, or a new one."""
    return mutant(rng, load_programs(ROOT.parent / "shared" / "nc"), start)


def try_program(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """Read a program, and show now and then what `info` says of it."""
    source = f"mutant.{rng.choice(ENDINGS)}"
    end = outcome(data, a_reading(rng), a_machine(rng), source)
    if end == "read" and rng.random() < INFO:
        file = place.folder / source
        file.write_bytes(data)
        place.command("info", file)
    return end


def a_reading(rng: np.random.Generator) -> Any:
    """Settings of the reader by chance."""
    from planner.nc.reading import ARC_CENTRES, DIALECTS, EXTRUDERS, Reading

    ignore = ("M6", "A", "$J", "G29", "M428")[: int(rng.integers(0, 6))]
    return Reading(
        strict=bool(rng.random() < 0.15),
        ignore=ignore if rng.random() < 0.3 else (),
        arc_centres=str(rng.choice(ARC_CENTRES)) if rng.random() < 0.3 else "auto",
        extruder=str(rng.choice(EXTRUDERS)),
        dialect=str(rng.choice(DIALECTS)) if rng.random() < 0.3 else "auto",
        block_delete=bool(rng.random() < 0.7),
    )


def outcome(data: bytes, reading: Any, machine: Any = None, source: str = "mutant.nc") -> str:
    """What comes of a program: "read", "refused" or "not a program". Raises what is not a proper end."""
    from planner.base.errors import InputError
    from planner.nc.reader import interpret

    try:
        program, faults = interpret(data, machine, reading, source=source)
    except InputError as fault:
        if not str(fault):
            raise ValueError("refused without a sentence") from fault
        return "not a program"
    if not np.isfinite(program.end).all() or len(program.notes) > NOTES_MAX:
        raise ValueError(f"positions {program.end}, {len(program.notes)} notes")
    for fault in faults[:5]:
        if fault.line < 1 or fault.column < 1 or not fault.message:
            raise ValueError(f"a fault without a place: {fault}")
    return "refused" if faults else "read"


def a_machine(rng: np.random.Generator) -> Any:
    """None, a machine with all axes and an extruder, a lathe, or one of the package, by chance."""
    which = rng.random()
    if which < 0.4:
        return None
    if which < 0.6:
        shipped = sorted((ROOT / "planner" / "machines").glob("*.toml"))
        return _shipped(shipped[int(rng.integers(len(shipped)))])
    return _all_axes(lathe=which > 0.85)


@cache
def _shipped(file: Path) -> Any:
    from planner.machine.files import load_machine

    return load_machine(file)


@cache
def _all_axes(lathe: bool) -> Any:
    from planner.machine.files import machine_from_dict

    axis = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5}
    axes = {letter: dict(axis) for letter in "xyzabcuvwe"}
    machine = {"name": "all axes", "tolerance": 0.02, "dt": 1e-3, "axes": axes}
    return machine_from_dict(
        machine | ({"dialect": {"lathe": True, "least_increment": 1e-3}} if lathe else {})
    )


@cache
def load_programs(folder: Path) -> list[list[bytes]]:
    """The lines of the programs of a folder; of long ones the first 3,000."""
    files = sorted(f for f in folder.glob("*") if f.suffix not in (".csv", ".md", ".txt"))
    return [f.read_bytes().splitlines()[:3000] for f in files]
