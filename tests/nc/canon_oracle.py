#!/usr/bin/python3
"""What LinuxCNC's own interpreter makes of NC programs; runs in a process of its own, with the system's Python.

    canon_oracle.py CANON_FOLDER JOBS.json OUT.npz

CANON_FOLDER holds `lcnc_canon.py`. A job is {"path", "parameters": {number: inch}, "tools": {number: length [inch]}}. OUT gets per
job k the arrays k.move (M, 11) and k.error (a text, empty if the program was read to its end).
Columns of a move: kind (0 rapid, 1 feed, 2 arc, 3 dwell), line, end x y z, feed [mm/min] or seconds, centre x y z, normal axis.

The module `gcode` differs from the standalone `rs274` where this matters: it looks tools up in a table shared with a running
LinuxCNC (lcnc_canon makes one, numbers 1 to 99) and asks `get_tool` for their lengths; parameters are lengths in inches; and a
file without M2, M30 or % is an error at its end, after all its moves.
"""

import json
import os
import sys
import tempfile

import numpy as np

KINDS = {"rapid": 0, "feed": 1, "arc": 2, "dwell": 3, "tap": 1}
INIT = "G21 G90 G17 G94 G40 G49 G54"


def main(folder, jobs_file, out_file):
    sys.path.insert(0, folder)
    import gcode
    import lcnc_canon

    class Canon(lcnc_canon.Canon):
        """Adds the tool offset, and keeps moves as rows of numbers."""

        tool = (0.0,) * 9

        def get_tool(self, index):  # number, x y z a b c u v w offsets, diameter, angles, orientation
            return (index, 0.0, 0.0, self.lengths.get(str(index), 0.0), *(0.0,) * 9, 0)

        def tool_offset(self, *offset):
            self.tool = offset

        def _machine(self, p):
            return [a + b for a, b in zip(lcnc_canon.Canon._machine(self, p), self.tool, strict=False)]

    def row(move):
        nothing = (0.0, 0.0, 0.0)
        normal = float(np.argmax(move["normal"])) if "normal" in move else -1.0
        amount = move["t"] if move["kind"] == "dwell" else move["feed"]
        return (
            KINDS[move["kind"]],
            move["line"],
            *move.get("end", nothing),
            amount,
            *move.get("center", nothing),
            normal,
            move.get("turns", 0),
        )

    results = {}
    with open(jobs_file) as handle:
        jobs = json.load(handle)
    for k, job in enumerate(jobs):
        with tempfile.TemporaryDirectory() as scratch:
            parameters = os.path.join(scratch, "p.var")
            with open(parameters, "w") as handle:
                for number, value in sorted((int(n), v) for n, v in job.get("parameters", {}).items()):
                    handle.write(f"{number}\t{value!r}\n")
            canon = Canon(parameters)
            canon.lengths = job.get("tools", {})
            status, line = gcode.parse(job["path"], canon, "G21", INIT)
        error = f"{line}: {gcode.strerror(status)}" if status > gcode.MIN_ERROR else ""
        moves = []
        for move in canon.out:
            if move["kind"] in KINDS:
                moves.append(row(move))
            if move["kind"] == "tap":  # goes on from where it began
                began = moves[-2] if len(moves) > 1 else row({**move, "end": (0.0, 0.0, 0.0)})
                moves.append((1, move["line"], *began[2:5], *moves[-1][5:]))
        results[f"{k}.move"] = np.array(moves, dtype=float).reshape(-1, 11)
        results[f"{k}.error"] = np.array(error)
    np.savez(out_file, **results)


if __name__ == "__main__":
    main(*sys.argv[1:])
