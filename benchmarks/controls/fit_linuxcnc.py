"""`planner machine fit` against LinuxCNC's own planner: known accelerations found from the times of the five test programs, then the
times of programs that it has not seen.

    python -m benchmarks.controls.fit_linuxcnc --peers FOLDER

FOLDER is a copy of ../shared/peers with the compiled `tp_harness`; its planner is set to 100 mm/s, and to 700, 2000 and 5000 mm/s2,
while the machine file says 2000 mm/s2. Times carry noise of 0.1 %. Beside them limits from recorded motions of x.nc, y.nc and
z.nc, with two long rapids at their end: positions at 1 ms with noise of 1 um.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

import planner
from benchmarks.controls.control_times import SHARED
from benchmarks.record import markdown, write_results
from planner.controls.timing.fit import fitted, programs_to_time
from planner.controls.timing.times import control_times
from planner.controls.timing.traces import Trace, limits_of
from planner.machine import load_machine

UNSEEN = ("a_pentagon", "b_zigzag", "d_starspiral", "e_chips")
NOISE = 0.001  # of a time
NOISE_OF_PLACE = 0.001  # [mm]
RAPIDS = "G0 X60 Y60 Z60\nG0 X0 Y0 Z0\nM2"  # long enough for the highest speed


def taken(peers: Path, file: Path, accel: float) -> float:
    """Time on LinuxCNC with G64 P0.05 Q0 [s]."""
    command = ["/usr/bin/python3", str(peers / "lcnc_fast.py"), str(file), "--tol", "0.05", "--q", "0"]
    done = subprocess.run([*command, "--amax", str(accel)], capture_output=True, text=True, check=True)
    return float(json.loads(done.stdout)["cycle_time"])


def recorded(peers: Path, file: Path, accel: float, rng: np.random.Generator) -> Trace:
    """The motion of a program on LinuxCNC, with noise."""
    slower, out = file.with_suffix(".ngc"), file.with_suffix(".npz")
    slower.write_text(file.read_text().replace("M2", RAPIDS))
    command = ["/usr/bin/python3", str(peers / "lcnc_fast.py"), str(slower), "--tol", "0.05", "--q", "0"]
    subprocess.run([*command, "--amax", str(accel), "--out", str(out)], capture_output=True, check=True)
    with np.load(out) as motion:
        place = motion["xyz"] + rng.normal(0.0, NOISE_OF_PLACE, motion["xyz"].shape)
        return Trace(t=motion["t"], position=dict(zip("xyz", place.T, strict=True)), source=str(file))


def main() -> None:
    """Fit, and write results/machine-fit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--peers", type=Path, required=True)
    options = parser.parse_args()
    machine, rng, rows = load_machine(SHARED / "machines" / "peers.toml"), np.random.default_rng(1), []
    for accel in (700.0, 2000.0, 5000.0):
        with tempfile.TemporaryDirectory() as folder:
            measured = {}
            for name, text in programs_to_time(machine, "linuxcnc").items():
                file = Path(folder) / name
                file.write_text(text)
                seconds = taken(options.peers, file, accel) * rng.normal(1.0, NOISE)
                measured[name] = (planner.read_program(text=text), seconds)
            files = [Path(folder) / f"{letter}.nc" for letter in "xyz"]
            traces = [recorded(options.peers, file, accel, rng) for file in files]
        found = fitted(measured, machine, "linuxcnc")
        for name, _, value in found.settings:
            wanted = 1.0 if name == "factor" else accel
            rows.append(
                [f"{accel:g}", name, f"{wanted:g}", f"{value:.5g}", f"{100 * (value / wanted - 1):+.2f}"]
            )
        for name, before, value in limits_of(traces, machine)[1]:
            wanted = accel if name.endswith("acceleration") else before
            off = f"{100 * (value / wanted - 1):+.2f}"
            rows.append([f"{accel:g}", f"{name}, recorded", f"{wanted:g}", f"{value:.5g}", off])
        for job in UNSEEN:
            file = SHARED / "peers" / "programs" / f"{job}.ngc"
            own, program = taken(options.peers, file, accel), planner.read_program(file, machine)
            predicted = control_times(program, found.machine, "linuxcnc", 0.05).seconds
            rows.append(
                [
                    f"{accel:g}",
                    f"{job} [s]",
                    f"{own:.3f}",
                    f"{predicted:.3f}",
                    f"{100 * (predicted / own - 1):+.2f}",
                ]
            )
    table = markdown(["acceleration [mm/s2]", "what", "LinuxCNC's", "found", "off [%]"], rows)
    write_results("machine-fit", {"rows": rows}, table)


if __name__ == "__main__":
    main()
