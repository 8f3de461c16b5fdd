"""The first parts of programs with rotary axes, in LinuxCNC itself and planned: cycle times under the same limits of the joints.

    python -m benchmarks.controls.rotary_linuxcnc --peers FOLDER [--only PART_OF_NAME ...]

Needs LinuxCNC (Debian's package linuxcnc-uspace) and FOLDER, a copy of ../shared/peers that an ordinary user may read: its
`linuxcnc_run.py` is the user interface that starts the program. LinuxCNC runs as a simulation without hardware, as the user `lcnc`
(it refuses root), with trivial kinematics and one joint per axis, the velocity and the acceleration of mill-xyzabc.toml, and G64 with
the tolerance of that file and Q0. It knows no limit of the jerk. Only the first `lines` of each program run, so that one takes some
minutes at most, the same for all. M428 and M429 are taken out for LinuxCNC: every axis is a joint, as in the plans.

LinuxCNC's time is the number of servo periods in which a joint moves, so that neither tool changes nor a starved queue counts.
"""

from __future__ import annotations

import argparse
import json
import os
import pwd
import re
import shutil
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import planner
from benchmarks.controls.four_ways import SHARED, USER
from benchmarks.record import markdown, write_results
from planner.base.arrays import FloatArray
from planner.machine import Machine, load_machine

MACHINE = Path(__file__).parents[1] / "programs" / "mill-xyzabc.toml"
ROTARY = "abc"
ENDLESS = 1e6  # positions and following errors are not limited [mm or deg]
STILL = 5e-7  # half of the last digit that halsampler prints [mm or deg]
PATIENCE = 300.0  # for one program [s]


@dataclass(frozen=True)
class Part:
    """The first `lines` lines of a program of ../shared/nc."""

    file: str
    lines: int


PARTS = (
    Part("Sienci-Labs__gsender__FourAxisSurface_finishPass.nc", 40),
    Part("Sienci-Labs__gsender__4006.nc", 3500),
    Part("LinuxCNC__linuxcnc__impeller-7bl-xyzac.ngc", 200),
    Part("Sienci-Labs__gsender__Skull_Finishing.gcode", 80),
)


def ini(machine: Machine, peers: Path, work: Path) -> str:
    """LinuxCNC's configuration for the machine: one joint per axis; in both, rotary limits are in degrees."""
    limits = {name: (axis.velocity, axis.acceleration) for name, axis in machine.axes.items()}
    linear = np.array([limits[name] for name in machine.axes if name not in ROTARY])
    turning = np.array([limits[name] for name in machine.axes if name in ROTARY] or linear)
    (v, a), (w, b) = np.sqrt((linear**2).sum(axis=0)), np.sqrt((turning**2).sum(axis=0))
    letters = "".join(machine.axes).upper()
    parts = [
        f"""[EMC]
VERSION = 1.1
MACHINE = headless
[DISPLAY]
DISPLAY = {peers}/linuxcnc_run.py --ui
PROGRAM_PREFIX = {work}
[TASK]
TASK = milltask
CYCLE_TIME = 0.001
[RS274NGC]
PARAMETER_FILE = sim.var
RS274NGC_STARTUP_CODE = G21 G17 G90 G94 G40 G49 G64
[EMCMOT]
EMCMOT = motmod
COMM_TIMEOUT = 4.0
SERVO_PERIOD = {round(machine.dt * 1e9)}
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.100
TOOL_TABLE = tool.tbl
[HAL]
HALFILE = sim.hal
[TRAJ]
COORDINATES = {" ".join(letters)}
LINEAR_UNITS = mm
ANGULAR_UNITS = degree
NO_FORCE_HOMING = 1
DEFAULT_LINEAR_VELOCITY = {v}
MAX_LINEAR_VELOCITY = {v}
DEFAULT_LINEAR_ACCELERATION = {a}
MAX_LINEAR_ACCELERATION = {a}
DEFAULT_ANGULAR_VELOCITY = {w}
MAX_ANGULAR_VELOCITY = {w}
DEFAULT_ANGULAR_ACCELERATION = {b}
MAX_ANGULAR_ACCELERATION = {b}
[KINS]
KINEMATICS = trivkins coordinates={letters}
JOINTS = {len(letters)}
"""
    ]
    for n, name in enumerate(machine.axes):
        velocity, acceleration = limits[name]
        both = f"MIN_LIMIT = {-ENDLESS}\nMAX_LIMIT = {ENDLESS}\nMAX_VELOCITY = {velocity}\nMAX_ACCELERATION = {acceleration}\n"
        kind = "ANGULAR" if name in ROTARY else "LINEAR"
        parts.append(
            f"[AXIS_{name.upper()}]\n{both}[JOINT_{n}]\nTYPE = {kind}\nHOME = 0\nHOME_SEQUENCE = 0\n{both}"
            f"FERROR = {ENDLESS}\nMIN_FERROR = {ENDLESS}\n"
        )
    return "".join(parts)


def hal(joints: int) -> str:
    """Joints that follow at once, and a sampler of their commands."""
    lines = [
        "loadrt [KINS]KINEMATICS",
        "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS",
        f"loadrt sampler depth=60000 cfg={'f' * joints}",
        "addf motion-command-handler servo-thread",
        "addf motion-controller servo-thread",
        "addf sampler.0 servo-thread",
        "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in",
        "net tc iocontrol.0.tool-change => iocontrol.0.tool-changed",
        "net tp iocontrol.0.tool-prepare => iocontrol.0.tool-prepared",
        "setp spindle.0.at-speed 1",
    ]
    lines += [
        f"net j{n} joint.{n}.motor-pos-cmd => joint.{n}.motor-pos-fb sampler.0.pin.{n}" for n in range(joints)
    ]
    return "\n".join(lines) + "\n"


def on_linuxcnc(text: str, machine: Machine, peers: Path) -> FloatArray:
    """(n, joints) commanded positions of every servo period [mm, deg]; RuntimeError where LinuxCNC says something or loses any."""
    user = pwd.getpwnam(USER)
    work = Path(tempfile.mkdtemp(prefix="lcnc_"))
    try:
        joined = re.sub(r"(?im)^\s*M42[89]\b.*$", "", text)
        files = {
            "job.ngc": f"G64 P{machine.tolerance:g} Q0\n{joined}\nM2\n",
            "sim.ini": ini(machine, peers, work),
            "sim.hal": hal(len(machine.axes)),
            "sim.var": "",
            "tool.tbl": "".join(f"T{k} P{k} Z0 D0\n" for k in range(1, 100)),
            "job.json": json.dumps(
                {
                    "program": str(work / "job.ngc"),
                    "raw": str(work / "raw.txt"),
                    "result": str(work / "result.json"),
                    "limit": PATIENCE,
                }
            ),
        }
        for name, content in files.items():
            (work / name).write_text(content, encoding="utf-8")
        for path in (work, *work.iterdir()):
            os.chown(path, user.pw_uid, user.pw_gid)
        given = {
            "PEER_JOB": str(work / "job.json"),
            "HOME": user.pw_dir,
            "USER": USER,
            "PATH": "/usr/bin:/bin:/usr/sbin:/sbin",
        }
        command = ["runuser", "-u", USER, "--", "linuxcnc", str(work / "sim.ini")]
        done = subprocess.run(
            command,
            env=given,
            cwd=work,
            capture_output=True,
            text=True,
            timeout=PATIENCE + 60.0,
            stdin=subprocess.DEVNULL,
            check=False,
        )
        result = work / "result.json"
        if not result.exists():
            raise RuntimeError(done.stdout[-2000:] + done.stderr[-2000:])
        messages = json.loads(result.read_text())["messages"]
        raw = (work / "raw.txt").read_text().splitlines()
    finally:
        shutil.rmtree(work, ignore_errors=True)
    if messages or any("overrun" in line for line in raw):
        raise RuntimeError(f"LinuxCNC said {messages}, or periods were lost")
    positions = np.array([[float(word) for word in line.split()] for line in raw])[:, -len(machine.axes) :]
    return positions


def measure(part: Part, machine: Machine, peers: Path) -> dict[str, Any]:
    """LinuxCNC's time and the planned ones of the first part of a program."""
    lines = (SHARED / "nc" / part.file).read_text(errors="replace").splitlines()[: part.lines]
    text = "\n".join(lines) + "\n"
    positions = on_linuxcnc(text, machine, peers)
    moved = (np.abs(np.diff(positions, axis=0)) > STILL).any(axis=1)
    moving = np.flatnonzero(moved)
    row = {
        "program": part.file,
        "lines": part.lines,
        "linuxcnc": int(moved.sum()) * machine.dt,
        "linuxcnc_with_pauses": int(moving[-1] + 1 - moving[0]) * machine.dt,
    }
    program = planner.read_program(text=text, machine=machine)
    for method in ("stop", "second-order", "optimal"):
        plan = planner.plan(program, machine, method=method)
        row[method] = plan.cycle_time
        row[f"{method}_passed"] = plan.verdict is not None and plan.verdict.passed
        row[f"{method}_end"] = [float(end) for end in plan.require().trajectory.position[-1]]
    row["linuxcnc_end"] = [float(end) for end in positions[-1]]
    return row


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", type=Path, required=True)
    parser.add_argument("--only", nargs="*", default=[""])
    asked = parser.parse_args()
    machine = load_machine(MACHINE)
    rows = []
    for part in PARTS:
        if any(word in part.file for word in asked.only):
            rows.append(measure(part, machine, asked.peers))
            print(rows[-1], flush=True)
    columns = ["program", "first lines", "LinuxCNC 2.9 [s]", "a stop at every block [s]"]
    columns += ["second-order [s]", "optimal, with jerk [s]", "verdicts"]
    shown = [
        [
            row["program"],
            f"{row['lines']:,}",
            f"{row['linuxcnc']:.3f}",
            f"{row['stop']:.3f}",
            f"{row['second-order']:.3f}",
            f"{row['optimal']:.3f}",
            "passed" if all(row[f"{m}_passed"] for m in ("stop", "second-order", "optimal")) else "failed",
        ]
        for row in rows
    ]
    write_results("rotary-linuxcnc", {"rows": rows}, markdown(columns, shown))


if __name__ == "__main__":
    main()
