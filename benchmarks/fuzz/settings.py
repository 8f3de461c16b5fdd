"""Fuzzing of drawings (HPGL), machine files and settings of controls: what is tried, and with what commands."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from benchmarks.fuzz.mutate import ODD_NUMBERS, text_of
from benchmarks.fuzz.run import Place

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared"
SLOWEST = (
    1e-3  # by which limits become lower: with less the motion has millions of samples, and takes its time
)
JOB = "G21 G90 F900\nG1 X5 Y1\nG2 X9 Y5 R4\nG1 X2\nM2\n"

# ------------------------------------------------------------------------------------------ drawings

DRAWINGS = (
    b"IN;SP1;PU0,0;PD400,0,400,400;PU;SP0;",
    b"IN;IP0,0,4000,4000;SC0,100,0,100;SP1;VS10;PA50,50;CI20;PU10,10;PD;EA90,90;PU;",
    b"IN;PR;PD100,0,0,100;AA200,200,90;AR-100,0,-180,5;PU;\nAT100,0,200,100;RT10,10,20,0;ER40,40;",
    b'\x1b.@;\x1b.I81;;17:IN;SP1;VS40,1;LBhello\x03;DT*;LBa*;PD0,0;CO"a;b";PG;PD9,9;',
    b"in;pu;pa 0 0;pd 100 200 -300 +4.5;RO90;IW;PE<=a9;UC;WU;PW0.3;FT3;PM0;PD1,1;PM2;FP;EP;",
)
_NAMES = "INDFPUPDPAPRAAARATRTCIEAERSPVSIPSCPGAFAHFRROIWLBCODTPEBRBZEWRARRWGUCFPEPPMLTPWWURPIRPSOEOA"
NAMES = [_NAMES[k : k + 2] for k in range(0, len(_NAMES), 2)]


def make_drawing(rng: np.random.Generator, start: bytes | None, _: Place) -> bytes:
    """A drawing: of the corpus with changes, or instructions one after the other."""
    if start is not None or rng.random() < 0.6:
        texts = [text.replace(b";", b";\n") for text in (*DRAWINGS, *_files())]
        text = text_of(rng, texts, start=start and start.replace(b";", b";\n").replace(b"\n\n", b"\n"))
        return text if rng.random() < 0.5 else text.replace(b"\n", b"")
    parts = ["IN;", "PD"][: int(rng.integers(0, 3))]
    for _ in range(int(rng.integers(1, 30))):
        parts.append(NAMES[int(rng.integers(len(NAMES)))])
        size, digits = 10 ** rng.uniform(-1, 5), int(rng.integers(0, 3))
        values = [f"{v:g}" for v in np.round(rng.normal(size=int(rng.integers(0, 8))) * size, digits)]
        if values and rng.random() < 0.1:
            values[0] = ODD_NUMBERS[int(rng.integers(len(ODD_NUMBERS)))].decode("latin-1")
        parts.append(str(rng.choice([",", " ", ", "])).join(values))
        parts.append(str(rng.choice([";", "", "\n", ";;"], p=[0.7, 0.15, 0.1, 0.05])))
    return "".join(parts).encode("utf-8")


@cache
def _files() -> list[bytes]:
    files = sorted((SHARED / "nc").glob("*"))
    return [file.read_bytes()[:4000] for file in files if file.suffix in (".hpgl", ".plt")]


def try_drawing(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """Look at a drawing, and plan it from stop to stop if it can be read."""
    file = place.folder / "drawing.plt"
    file.write_bytes(data)
    machine = "plotter" if rng.random() < 0.8 else "mill"
    code = place.command("info", file, "-m", machine)
    end = planned(place.command("plan", file, "-m", machine, "--method", "stop", "-q"))
    return "refused" if code else end


def planned(code: int) -> str:
    """What came of `planner plan`, by its exit code."""
    return {0: "planned", 1: "verdict failed", 2: "refused", 3: "not solved"}[code]


# ------------------------------------------------------------------------------------------ machine files

KEYS = b"""rotary_radius = 50.0
tolerance_angle = 0.01
feed_default = 10.0
feed_max = 100.0
normal_acceleration = 1500.0
blend_rapids = true
path_control = "exact_stop"
[axes.a]
velocity = 90.0
acceleration = 900.0
jerk = 9000.0
wrapped = true
[axes.e]
velocity = 50.0
[dialect]
least_increment = 0.001
lathe = true
[fir]
times = [0.004, 0.01]
[[modes]]
frequency = 30.0
damping = 0.05
[tools.1]
length = 50.0
diameter = 6.0
[positions.g28]
x = 1.0
[work_offsets.g55]
x = 1.0
[plotter]
unit = 0.025
[kinematics]
kind = "table-table"
tool_length = 50.0"""


@cache
def _machines() -> list[bytes]:
    places = (ROOT / "planner" / "machines", ROOT / "planner" / "templates", SHARED / "machines")
    files = [file.read_bytes() for place in places for file in sorted(place.glob("*.toml"))]
    template = (places[1] / "machine.toml").read_bytes()
    return [*files, template.replace(b"\n# ", b"\n"), KEYS]


def make_machine(rng: np.random.Generator, start: bytes | None, _: Place) -> bytes:
    """A machine file with changes."""
    return text_of(rng, _machines(), SLOWEST, start)


def try_machine(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """Plan a small job on a machine by chance."""
    file, job = place.folder / "machine.toml", place.folder / "job.ngc"
    file.write_bytes(data)
    job.write_text(JOB)
    method = str(rng.choice(["stop", "kinematic", "fir"], p=[0.6, 0.3, 0.1]))
    return planned(place.command("plan", job, "-m", file, "--method", method, "-q"))


# ------------------------------------------------------------------------------------------ settings of controls

SETTINGS = {
    "linuxcnc": b"""[EMC]
MACHINE = sim
VERSION = 1.1
[TRAJ]
COORDINATES = X Y Z A
LINEAR_UNITS = inch
ANGULAR_UNITS = degree
MAX_LINEAR_VELOCITY = 4
[EMCMOT]
SERVO_PERIOD = 2000000  # ns
[RS274NGC]
RS274NGC_STARTUP_CODE = G20 G40 G64 P0.001 G90
[KINS]
KINEMATICS = trivkins coordinates=XYYZ kinstype=BOTH
JOINTS = 4
[AXIS_X]
  MAX_VELOCITY = 3
MAX_ACCELERATION = 20
[AXIS_Y]
MAX_VELOCITY = 5
MAX_ACCELERATION = 30
[AXIS_A]
MAX_VELOCITY = 5
MAX_ACCELERATION = 30
[AXIS_Z]
MAX_VELOCITY = 1
MAX_ACCELERATION = 10
MAX_JERK = 200
[JOINT_0]
MAX_VELOCITY = 2
#INCLUDE other.txt
[JOINT_2]
MAX_ACCELERATION = 25
""",
    "grbl": b"$10=1\n$11=0.010 (junc dev, mm)\n$12=0.002\n$13=0\n$100=250.000\n$110=6000.000 (x max rate, mm/min)\n"
    b"$111=3000.000\n$112=600.000\n"
    b"$120=500.000 (x accel, mm/sec^2)\n$121=400.000\n$122=50.000\n$130=200\nok\n",
    "klipper": b"""[mcu]
serial: /dev/serial
[printer]
kinematics: corexy
max_velocity: 300   # mm/s
max_accel: 3000
max_z_velocity: 15
max_z_accel: 100
square_corner_velocity: 5.0
[include oth*.txt]
[gcode_macro PARK]
gcode:
    max_velocity: 1
    G1 X0 ; away
[input_shaper]
shaper_freq_x: 57.2
#*# <---------------------- SAVE_CONFIG ---------------------->
#*# [input_shaper]
#*# shaper_freq_x = 57.2
#*# shaper_freq_y = 34.0
#*# damping_ratio_y = 0.05
""",
    "marlin": b"""echo:; Linear Units:
echo:  G21 ; (mm)
echo:  M203 X500.00 Y400.00 Z5.00 E25.00
echo:  M201 X500.00 Y500.00 Z100.00 E5000.00
echo:  M204 P400.00 R500.00 T1000.00
echo:  M205 B20000.00 S0.00 T0.00 X8.00 Y8.00 Z0.40 E5.00 J0.013
echo:  M593 X F40.00 D0.10
echo:  M593 Y F50.00 D0.10
""",
}


def make_settings(rng: np.random.Generator, start: bytes | None, _: Place) -> bytes:
    """Settings of a control with changes, now and then with lines of other controls."""
    one = [SETTINGS[str(rng.choice([*SETTINGS]))]]
    return text_of(rng, [*SETTINGS.values()] if rng.random() < 0.3 else one, SLOWEST, start)


def try_settings(data: bytes, rng: np.random.Generator, place: Place) -> str:
    """Make a machine file of settings, and plan a small job on it."""
    settings, out, job = (place.folder / name for name in ("settings.txt", "made.toml", "job.ngc"))
    settings.write_bytes(data)
    (place.folder / "other.txt").write_bytes(text_of(rng, [*SETTINGS.values()], SLOWEST))
    out.unlink(missing_ok=True)
    options: list[str] = []
    if rng.random() < 0.3:
        options += ["--control", str(rng.choice([*SETTINGS]))]
    if rng.random() < 0.2:
        limit = f"{rng.choice(list('xyzabq'))}.{rng.choice(['velocity', 'jerk', 'speed'])}"
        options += ["--set", f"{limit}={rng.choice(['1', '1e4', '-1', 'nan', '1e308', ''])}"]
    if rng.random() < 0.1:
        options += ["--ramp-time", str(rng.choice(["0.01", "1e-300", "1e300", "0"]))]
    if place.command("machine", "import", settings, "-o", out, *options):
        if out.exists():
            raise AssertionError("refused settings, and a machine file is written")
        return "refused"
    job.write_text(JOB)
    if place.command("info", job, "-m", out):
        raise AssertionError("a machine file was made that is refused")
    end = planned(place.command("plan", job, "-m", out, "--method", "stop", "-q"))  # it may take days
    return f"made, {end}"
