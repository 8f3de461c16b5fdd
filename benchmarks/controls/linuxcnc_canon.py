#!/usr/bin/python3
"""What LinuxCNC's own interpreter makes of NC programs; runs in a process of its own, with the system's Python.

    /usr/bin/python3 linuxcnc_canon.py JOBS.json OUT.npz

Debian's package linuxcnc-uspace brings the module `gcode` for that Python: an interpreter that calls methods of an object for all that
a machine would do. Here that object, `Listener`, keeps the moves.

A job is {"path", "parameters": {number: value}, "tools": {number: length}}, lengths in inches, as the module has them. OUT gets per
job k the arrays k.move (M, 11), k.further (M, 6) and k.error (a text, empty where the program was read to its end). Columns of a move:
kind (RAPID ...), line, end x y z [mm], feed [mm/min] or seconds, centre x y z [mm], normal axis (-1: no arc), turns with their sign;
of `further` the end of a b c [degrees] and u v w [mm]. Positions are those of the machine: the module leaves adding the offsets to its
listener.

Where the module differs from the standalone `rs274`: it looks tools up in a table that a running LinuxCNC shares, and crashes without
one; a file without M2, M30 or % is an error at its end, after all its moves.
"""

import ctypes
import json
import math
import os
import sys
import tempfile

import numpy as np

MM_PER_INCH = 25.4
RAPID, FEED, ARC, DWELL = range(4)
AXES = 9  # x y z a b c u v w
LENGTHS = np.array([1, 1, 1, 0, 0, 0, 1, 1, 1], dtype=bool)
# First and second axis of a plane and its normal, by the module's number: x y, y z, x z.
PLANES = {1: (0, 1, 2), 2: (1, 2, 0), 3: (2, 0, 1)}
START = "G21 G90 G17 G94 G40 G49 G54"
TOOLS = 99


def share_tool_table():
    """Make the table that T words look tools up in: TOOLS tools of no length (Listener.get_tool gives the lengths)."""
    home = os.environ.get("HOME")
    with tempfile.TemporaryDirectory() as folder:
        table = os.path.join(folder, "tool.tbl")
        with open(table, "w") as file:
            file.writelines(f"T{n} P{n} Z0 D0\n" for n in range(1, TOOLS + 1))
        os.environ["HOME"] = folder  # the shared file goes there
        data = ctypes.CDLL("libtooldata.so.0")  # its functions have C++ names
        data._Z17tool_mmap_creatorPK13EMC_TOOL_STATi(None, 0)
        data._Z13tooldata_initb(False)
        data._Z13tooldata_loadPKcPPc(table.encode(), None)
        if home is not None:
            os.environ["HOME"] = home


class Listener:
    """What the interpreter calls."""

    def __init__(self, parameter_file, lengths):
        self.parameter_file, self.lengths = parameter_file, lengths
        self.moves, self.further = [], []
        self.work, self.shift, self.tool = np.zeros(AXES), np.zeros(AXES), np.zeros(AXES)
        self.turned = self.feed = 0.0
        self.plane, self.line = 1, 0

    # what it asks

    def get_external_length_units(self):
        return 1.0 / MM_PER_INCH

    def get_external_angular_units(self):
        return 1.0

    def get_axis_mask(self):
        return (1 << AXES) - 1

    def get_block_delete(self):
        return False

    def get_tool(self, number):  # number, nine offsets, diameter, two angles, orientation
        return (number, 0.0, 0.0, self.lengths.get(str(number), 0.0), *(0.0,) * 9, 0)

    def check_abort(self):
        return False

    # what it sets

    def next_line(self, state):
        self.line = state.sequence_number

    def set_plane(self, plane):
        self.plane = plane

    def set_feed_rate(self, feed):
        self.feed = feed * MM_PER_INCH

    def set_g5x_offset(self, _number, *offset):
        self.work = np.array(offset)

    def set_g92_offset(self, *offset):
        self.shift = np.array(offset)

    def set_xy_rotation(self, degrees):
        self.turned = math.radians(degrees)

    def tool_offset(self, *offset):
        self.tool = np.array(offset)

    # what moves

    def straight_traverse(self, *place):
        self._add(RAPID, place)

    def straight_feed(self, *place):
        self._add(FEED, place)

    def rigid_tap(self, x, y, z, _scale=0.0):
        """To the depth and back."""
        before = self.moves[-1][2:5] if self.moves else (0.0, 0.0, 0.0)
        self._add(FEED, (x, y, z, *(0.0,) * 6))
        self.moves.append((FEED, self.line, *before, *self.moves[-1][5:]))
        self.further.append(self.further[-1])

    def arc_feed(self, first, second, first_centre, second_centre, turns, along, *others):
        a, b, normal = PLANES[self.plane]
        place, centre = np.zeros(AXES), np.zeros(AXES)
        place[[a, b, normal]], place[3:] = (first, second, along), others
        centre[[a, b, normal]] = first_centre, second_centre, along
        self._add(ARC, place, self._machine(centre)[:3], normal, turns)

    def dwell(self, seconds):
        self.moves.append((DWELL, self.line, 0.0, 0.0, 0.0, seconds, 0.0, 0.0, 0.0, -1, 0))
        self.further.append((0.0,) * 6)

    def __getattr__(self, name):
        """Every other call: coolant, spindle, comments."""
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *_: None

    def _machine(self, place):
        """(9,) a place of the program in machine coordinates [mm, degrees]."""
        found = np.array(place) + self.shift
        if self.turned:
            cosine, sine = math.cos(self.turned), math.sin(self.turned)
            found[:2] = found[0] * cosine - found[1] * sine, found[0] * sine + found[1] * cosine
        found = found + self.work + self.tool
        return np.where(LENGTHS, found * MM_PER_INCH, found)

    def _add(self, kind, place, centre=(0.0, 0.0, 0.0), normal=-1, turns=0):
        found = self._machine(place)
        self.moves.append((kind, self.line, *found[:3], self.feed, *centre, normal, turns))
        self.further.append(tuple(found[3:]))


def read(job):
    """The moves of a job's program, and the interpreter's error."""
    import gcode

    with tempfile.TemporaryDirectory() as folder:
        parameters = os.path.join(folder, "parameters.var")
        with open(parameters, "w") as file:
            for number, value in sorted((int(n), v) for n, v in job.get("parameters", {}).items()):
                file.write(f"{number}\t{value!r}\n")
        listener = Listener(parameters, job.get("tools", {}))
        status, line = gcode.parse(job["path"], listener, "G21", START)
    return listener, f"{line}: {gcode.strerror(status)}" if status > gcode.MIN_ERROR else ""


def main(jobs_file, out_file):
    """Read all jobs."""
    share_tool_table()
    results = {}
    with open(jobs_file) as file:
        jobs = json.load(file)
    for k, job in enumerate(jobs):
        listener, error = read(job)
        results[f"{k}.move"] = np.array(listener.moves, dtype=float).reshape(-1, 11)
        results[f"{k}.further"] = np.array(listener.further, dtype=float).reshape(-1, 6)
        results[f"{k}.error"] = np.array(error)
    np.savez(out_file, **results)


if __name__ == "__main__":
    main(*sys.argv[1:])
