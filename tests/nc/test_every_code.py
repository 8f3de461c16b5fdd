"""The law of all dialects, over their tables of codes: a word is part of the motion or its time, is refused with its line, is said
first, or stands in a table here with the reason why it moves nothing and lasts nothing."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import pytest
from same_program import machine

from planner.base.errors import InputError
from planner.nc import codes, settings
from planner.nc.hpgl import instructions
from planner.nc.language.heidenhain import tables as conversational_tables
from planner.nc.language.siemens import tables
from planner.nc.program import Program
from planner.nc.reader import parse_program
from planner.nc.reading import Reading

SYSTEMS = ("g54", "g55", "g56", "g57", "g58", "g59", "g59.1", "g59.2", "g59.3")
MACHINE = machine(
    tools={"1": {"length": 25.0, "diameter": 2.0}, "2": {"length": 9.0, "diameter": 3.0}},
    positions={"g28": {"x": 100.0, "z": 50.0}, "g30": {"z": 70.0}},
    work_offsets={name: {"x": 1.0 + k, "z": 2.0 + k} for k, name in enumerate(SYSTEMS)},
    times={"tool_change": 5.0},
)
MOTION = ("kind", "end", "feed", "dwell", "path_control", "tolerance", "arc_center", "arc_sweep", "extruded")
NOTHING = "nothing"


def motion(program: Program) -> list[bytes]:
    """All that is planned of it."""
    return [np.round(getattr(program, name).astype(float), 9).tobytes() for name in MOTION]


def outcome(text: str, without: Program, reading: Reading) -> str:
    """What a word does to a program that has it, beside the one without it."""
    try:
        program = parse_program(text, MACHINE, reading)
    except InputError as fault:
        return "refused" if fault.line is not None else f"refused without a line: {fault}"
    if set(program.assumptions) - set(without.assumptions):
        return "said"
    same = motion(program) == motion(without) and program.limits == without.limits
    return NOTHING if same else "moves"


def doing_nothing(
    words: Iterable[str], forms: Iterable[str], program: Callable[[str], str], reading: Reading
) -> set[str]:
    """The words that in some of their forms change nothing and of which nothing is said."""
    without = parse_program(program(""), MACHINE, reading)
    found = set()
    for word in words:
        if any(outcome(program(f"{word} {more}"), without, reading) == NOTHING for more in forms):
            found.add(word)
    return found


# --- RS274NGC, Fanuc, Haas, printers ----------------------------------------------------------------------------------------

# Words behind a code; codes that use others refuse these.
FORMS = ("", "P1", "S500", "X20 Y7 Z1", "P1 Q1")


def rs274(word: str) -> str:
    """The word between moves, arcs and a cycle, whose lengths have points: of a Fanuc program it is said where some have none."""
    return (
        f"G21 G90 G17 G94 G99 G64 P0.05 F600 S1000 T1\nM3\nG0 X1. Y2. Z3.\n{word}\nG0 X4. Y4.\nG1 X10. Y5. Z1. F300\nX20.5 Y8.\n"
        "G91.1 G2 X24.5 Y12. I4. J0.\nG81 X3. Y3. Z-2. R1.\nG80\nG1 X0.\nM2\n"
    )


SAMPLED = 13  # of the numbers that stand in no table, which one rule is for, every so many are tried
IN_FORCE = "is in force, or the program says it again"
G_NOTHING = {
    **dict.fromkeys(
        ["G0", "G1", "G17", "G21", "G40", "G49", "G54", "G80", "G90", "G91.1", "G94", "G99"], IN_FORCE
    ),
    "G51": "a scale of 1",
    **dict.fromkeys(["G92.1", "G92.2", "G92.3"], "there is no G92 offset to end or to bring back"),
    **dict.fromkeys(["G28.1", "G30.1"], "keeps a position; a later G28 goes there"),
    "G8": "the end of G7, which is not in force",
    "G43": "without H, and with no tool loaded: length 0",
    "G43.1": "without X Y Z it sets no length",
    "G67": "the end of a modal call, of which there is none",
    "G90.1": "of arcs, which say G91.1 themselves",
    "G98": "holes end at the level before them, which is that of R here",
    **dict.fromkeys(["G50", "G92", "G96", "G97"], "spindle speed: feeds are per minute (G94)"),
}
G_TABLE = sorted(
    {
        *codes.G_GROUP,
        *codes.G_REFUSED,
        *settings.ALWAYS_READ["G"],
        131,
        150,
        220,
        230,
        250,
        260,
        501,
        1030,
        1130,
        1870,
    }
    | {10 * n for n in range(200) if n < 100 or n % SAMPLED == 0}
)


@pytest.mark.shows("read-refused", "sampled: all codes of all tables")
@pytest.mark.slow
def test_g_codes() -> None:
    words = [f"G{codes.number(code)}" for code in G_TABLE]
    assert doing_nothing(words, FORMS, rs274, Reading()) == set(G_NOTHING)


PRINTER = {
    (17, 18, 84): "the motors' current",
    (73, 105, 114, 115, 117, 118, 119, 155, 413, 486, 503, 862, 928): "progress, questions, messages, reports",
    (82, 83): "E as a place or a step; the program has no extruder",
    (104, 140, 141, 106, 107, 108, 110, 111): "temperatures that nothing waits for, fans, the line number, log level",
    (120, 121, 126, 127, 142, 143, 144, 145, 149, 150, 163, 164): "endstops, valves, standby, units of temperatures, lights, mixes",
    (201, 202, 204, 220): "without the values that limit something here (tests/nc/test_set_limits.py has them)",
    (200, 221): "what E feeds; the program has no extruder",
    (207, 208): "lengths of retractions, which G10 and G11 say",
    (240, 250, 280, 300): "cameras, contrast, servos, sounds: nothing waits for them",
    (301, 302, 304, 305): "control of temperatures",
    (412, 500, 504): "the filament's sensor, settings that are kept",
    (557, 558, 569, 574, 575, 584, 851): "probes, drivers, switches: what is measured or wired",
    (572, 900): "the extruder leads the way; the way is as it is",
    (906, 907, 913, 914): "currents of motors",
}  # fmt: skip
M_OF_RS274 = {
    (3, 4, 5, 19): "spindle: feeds are per minute (G94)",
    (7, 8, 9): "coolant",
    (48, 49, 50, 51, 52, 53): "whether overrides count; nobody turns them in a plan",
    (61,): "the number of the loaded tool, whose length no G43 asks for here",
    (62, 63, 64, 65): "outputs",
    (66,): "an input that nothing waits for; with a wait it is refused",
    (70, 71): "keeps or forgets modes; M72 brings them back",
}
MORE = ("", "P1", "Q1", "S500", "X20 Y7 Z1", "P1 Q1", "S150 R5")


def m_numbers(own: Iterable[int] = ()) -> list[int]:
    """The M codes below 1000 that stand in a table of the reader, or among its `own`, and some of the others."""

    def in_a_table(n: int) -> bool:
        found = settings.setting("M", 10 * n, "", "")
        return 10 * n in {*codes.M_GROUP, *codes.M_REFUSED} or (
            found is not None and found.what is not settings.UNKNOWN_M
        )

    return [n for n in range(1000) if n % SAMPLED == 0 or n in own or in_a_table(n)]


@pytest.mark.shows("read-refused", "sampled: all codes of all tables")
@pytest.mark.slow
def test_m_codes() -> None:
    words = [f"M{n}" for n in m_numbers()]
    nothing = {f"M{n}" for numbers in (*PRINTER, *M_OF_RS274) for n in numbers}

    def fed(word: str) -> str:
        """Without rapids: those of printers run at F, which a code of theirs has said first."""
        return rs274(word).replace("G0 ", "G1 ").replace("G81 X3. Y3. Z-2. R1.\nG80\n", "")

    assert doing_nothing(words, MORE, fed, Reading()) == nothing


def test_g_codes_of_no_table_are_refused() -> None:
    without = parse_program(rs274(""), MACHINE)
    words = [f"G{n / 10:g}" for n in range(2000) if n not in set(G_TABLE)][::31]
    assert {outcome(rs274(f"{word} X20 Y7"), without, Reading()) for word in words} == {"refused"}


# --- Heidenhain --------------------------------------------------------------------------------------------------------------

HEIDENHAIN = Reading(dialect="heidenhain")
M_NOTHING = {
    **dict.fromkeys((3, 4, 5, 13, 14, 19), "spindle: feeds are per minute"),
    **dict.fromkeys((7, 8, 9), "coolant"),
    137: "feeds per minute, which are in force",
    **dict.fromkeys(conversational_tables.NOTHING, "heidenhain/tables.py says of each what it does"),
    **dict.fromkeys(conversational_tables.OF_COMPENSATION, "of compensation, which is off"),
    **dict.fromkeys((*conversational_tables.OF_ROTARY, 126), "of rotary axes, which the machine has not"),
}


def conversational(word: str) -> str:
    """The word, or the block, between moves and arcs."""
    return (
        "0 BEGIN PGM T MM\nTOOL DEF 1 L+2 R+1\nTOOL CALL 1 Z S1000 F300\nL X+0 Y+0 Z+5 FMAX M3\nL X+10 F500\n"
        f"{word}\nL X+20 Y+3\nCC X+20 Y+8\nC X+25 Y+8 DR+\nL Z+1\nEND PGM T MM\n"
    )


@pytest.mark.slow
def test_m_codes_of_heidenhain() -> None:
    words = [f"M{n}" for n in m_numbers(range(160)) if n not in (99,)]
    found = doing_nothing(words, ("",), conversational, HEIDENHAIN)
    assert found == {f"M{n}" for n in M_NOTHING}
    assert doing_nothing([f"L IX+1 M{n}" for n in range(160)], ("",), conversational, HEIDENHAIN) == set()


# Blocks that change nothing, each with its reason.
BLOCKS_NOTHING = {
    "BLK FORM 0.1 Z X+0 Y+0 Z-20": "the blank",
    "TOOL DEF 3": "has a tool ready",
    "* - contour": "a heading",
    "PLANE RESET STAY": "tilted planes are refused",
    "FUNCTION RESET": "what it would reset is refused",
    "CYCL DEF 32.0 TOLERANCE": "its lines follow",
    "CYCL DEF 32.2 HSC-MODE:1 TA0.5": "which filter the control takes; the tolerance is that of 32.1",
    "CYCL DEF 32.1": "the machine's tolerance, which is in force",
    "CYCL DEF 9.0 DWELL TIME": "its line follows",
    "FN 0: Q1 = +5": "a parameter that nothing asks for",
    **dict.fromkeys(
        ("FN 15: PRINT Q1", "FN 16: F-PRINT A", "FN 19: PLC = +1", "FN 26: TABOPEN A"),
        "texts, the PLC, tables of the control",
    ),
    "Q2 = 3 + Q1": "a parameter that nothing asks for",
    "TOOL CALL S2000": "spindle: feeds are per minute",
    "CC X+1 Y+1": "a pole that is set again before it counts",
    "LBL 5": "nothing calls it",
}
BLOCKS = (
    "L IX+3", "L F200", "L IX+1 FZ0.1", "L IX+1 R0 FU0.2", "L IX+1 M91", "LP PR+3 PA+1", "STOP", "FN 14: ERROR = 3",
    "FN 15: PRINT Q1", "FN 16: F-PRINT A", "FN 18: SYSREAD Q1 = ID270 NR1", "FN 19: PLC = +1", "FN 20: WAIT FOR SYNC",
    "FN 26: TABOPEN A", "TOOL CALL 2 Z", "TOOL CALL 1 Z DL+1", "CYCL DEF 32.1 T0.05", "CYCL DEF 32.1", "CYCL DEF 9.1 DWELL 2",
    "CYCL DEF 7.1 X+3", "CYCL DEF 10.1 ROT+5", "CYCL DEF 11.1 SCL 0.5", "CYCL DEF 13.1 ANGLE 5", "CYCL DEF 19.1 A+5",
    "CYCL DEF 247 Q339=1", "CYCL DEF 12.1 PGM B", "PLANE SPATIAL SPA+5", "FUNCTION TCPM F TCP",
    "FUNCTION TURNDATA SPIN VCONST:ON", "FUNCTION FEED DWELL D-TIME0.5", "TRANS DATUM AXIS X+1", "SEL PGM A",
    "FN 9: IF +1 EQU +1 GOTO LBL 9", "APPR LT X+20 Y+3 LEN5 RL", "LN X+1 NX+0 NY+0 NZ+1", "FL IX+2", "RND R1", "CHF 1", "M3 X+4",
    "STOP F300",
)  # fmt: skip


@pytest.mark.shows("read-refused", "sampled: all codes of all tables")
def test_blocks_of_heidenhain() -> None:
    words = (*BLOCKS_NOTHING, *BLOCKS)
    assert doing_nothing(words, ("",), conversational, HEIDENHAIN) == set(BLOCKS_NOTHING)


# --- Sinumerik ---------------------------------------------------------------------------------------------------------------

SIEMENS = Reading(dialect="siemens")
S_NOTHING = {
    **dict.fromkeys(["G0", "G1", "G17", "G40", "G54", "G71", "G90", "G94", "G710"], IN_FORCE),
    **dict.fromkeys(
        ["G64", "G641", "G642", "G643", "G644", "G645"],
        "continuous path with the machine's tolerance, which is in force",
    ),
    **dict.fromkeys(
        ["G450", "G451"], "outer corners under compensation, which is off; G451 with it is refused"
    ),
    **dict.fromkeys(["G601", "G602", "G603"], "when an exact stop ends: at the setpoint"),
    **dict.fromkeys(tables.IDLE, "siemens/tables.py: IDLE"),
    **dict.fromkeys(["ADISPOS=0.5"], "the tolerance of rapid moves, which are not blended"),
    **dict.fromkeys(["FGROUP", "FGROUP(X)"], "F is the speed of X, Y, Z"),
    **dict.fromkeys(["G110", "G111"], "a pole, which polar coordinates behind it refer to"),
    **dict.fromkeys(
        ["G140", "G460"], "how compensation would approach with G147 and G247, which are refused"
    ),
    **dict.fromkeys(["G25", "G25 X1", "G26", "G26 S100"], "limits of the spindle and of the working area"),
    **dict.fromkeys(["G961 S100", "G971 S1"], "spindle speed: feeds stay per minute"),
    "G290": "the language of Siemens, in which the program is",
    "TRAFOOF": "the end of TRAORI, which is refused without kinematics",
}


def sinumerik(word: str) -> str:
    return (
        "G17 G90 G71 G94 F600\nDEF REAL A\nT1 M6\nS1000 M3\nG0 X1 Y2 Z3\nG1 X10 F300\n"
        f"{word}\nG1 X20 Y8\nG2 X24 Y12 I4 J0\nG1 Z1\nM30\n"
    )


CALLED = {
    "SETMS": "SETMS(1)", "WORKPIECE": 'WORKPIECE(,,,"BOX",0)', "MSG": 'MSG("A")', "EXTERN": "EXTERN A1(REAL)", "LIMS": "LIMS=2000",
}  # fmt: skip
SPELLED = (
    "G153 G0 X1", "SUPA G0 X1", "G500 G0 X1", "G55 G0 X1", "G505 G0 X1", "TRANS X5", "ATRANS X5", "ROT RPL=5", "AROT RPL=5",
    "ROT X5", "SCALE X2", "ASCALE X2", "MIRROR X1", "AMIRROR X1", "DIAMON", "DIAM90", "DIAM90A", "DIAMCYCOF", "CFC", "CFIN",
    "SPOS=90", "SPOSA=90", "G4 F2", "G4 S2", "STOPRE", "OVR=50", "OVRA[X]=50", "ACC[X]=50", "VELOLIM[X]=50", "JERKLIM[X]=50",
    "FL[X]=100", "FGROUP(X)", "FGREF[A]=10", "FLIN", "FCUB", "FPO(1,2,3)", "SOFTA(X)", "BRISKA(X)", "DRIVEA(X)", "WALIMON",
    "WALIMOF", "POS[X]=5", "POSA[X]=5", "WAITP(X)", "TRACYL(20)", "TRANSMIT", "TOFRAME", "PAROT",
    'CYCLE800(1,"T",0,57,0,0,0,10,0,0,0,0,0,1)', "G25 X1", "G26 S100", "M17", "M0", "M1", "G331 Z-5 K1", "G63 Z-5", "G74 X1=0",
    "G75 X1=0", "TANGON(C,5)", "CUT3DC", "CUT3DF", "OFFN=2", "DISC=20", "DISR=3", "G140 G147 X30", "SPLINEPATH(1,X)",
    "BSPLINE X9", "ASPLINE X9", "POLY PO[X]=(5,1)", "AP=5 RP=3", "RNDM=2", "RND=1", "CHF=1", "FRC=100", "FRCM=100", "ADIS=0.5",
    "ADISPOS=0.5", "RTLIOF", "BRISK", "DRIVE", "D1", "D0", "ORIVECT", "ORIWKS", "G60", "G9", "G62", "G621", "G641", "G95 F1",
    "G93 F1", "G96 S100", "G961 S100", "G97 S1", "G971 S1", "G33 Z-5 K1", "G70", "G700", "G18", "G19", "G91", "G53 G0 X1",
    "MEAS=1 X9", "MEAW=1 X9", "REPOS", "RETPROC", "ROT Z5", "LEAD=5", "GOTOF ENDE", "ENDE: G1 X9", "CYCLE832(0.05,1)",
    "CYCLE81(9,0,2,-3)",
)  # fmt: skip


@pytest.mark.shows("read-refused", "sampled: all codes of all tables")
def test_words_of_sinumerik() -> None:
    every = {
        *tables.IDLE,
        *tables.SAID,
        *tables.REFUSED,
        "TRAORI",
        "TRAFOOF",
        *(f"G{n}" for n in range(1000) if n < 720 or n % SAMPLED == 0),
    }
    words = {CALLED.get(word, word) for word in every} | set(SPELLED)
    assert doing_nothing(words, ("",), sinumerik, SIEMENS) == {CALLED.get(word, word) for word in S_NOTHING}


# --- plotters ----------------------------------------------------------------------------------------------------------------

P_NOTHING = {
    **{name: why for name, why in instructions.IGNORED.items() if name not in instructions.CHANGING},
    "SC": "the end of scaling, which is not in force",
    "IP": "the paper's own corners: nothing is scaled",
    "SM": "the end of symbols at points",
    **dict.fromkeys(["PD", "PA", "DF"], IN_FORCE),
}


def plotted(word: str) -> str:
    text = "\x03" if word.strip() in ("WD", "BL", "MG") else ""  # whose text ends with it
    return f"IN;SP1;VS10;PU0,0;PD400,0;{word.strip()}{text};PD400,300,0,300;"


def test_instructions_of_plotters() -> None:
    tables = (instructions.IGNORED, instructions.REFUSED, instructions.FORMS)
    words = {name for table in tables for name in table}
    assert doing_nothing(words, ("",), plotted, Reading()) == set(P_NOTHING)
    more = [f"{name}1" for name in instructions.WITH_NUMBERS]
    assert doing_nothing(more, ("",), plotted, Reading()) == set()
