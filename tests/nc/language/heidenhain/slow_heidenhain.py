"""A second reading of conversational programs, plain and slow: one line after the other.

It knows L, CC, C, CR, CT, LP, CP with their incremental words, helices, the frames of cycles 7, 8, 10 and 11,
cycle 200 with one infeed, Q parameters with sums, FN 9 to 12, LBL, CALL LBL and REP. Moves end at (x, y, z);
arcs have the angle that they turn by.
"""

from __future__ import annotations

import cmath
import math
import re

WORD = re.compile(r"(I?(?:PR|PA|X|Y|Z|R))([-+][\d.]+|[-+]Q\d+)")


class SlowHeidenhain:
    """Reads `text`; `moves` are (kind, x, y, z, angle) in mm, kind 0 to 3."""

    def __init__(self, text: str):
        self.lines = [re.sub(r"^\d+ ", "", line).strip() for line in text.splitlines()]
        self.inch = self.lines[0].endswith("INCH")
        self.moves: list[tuple[float, ...]] = []
        self.q: dict[str, float] = {}
        self.place, self.z = 0j, 0.0  # in the work system [units of the program]
        self.pole, self.way = 0j, 1 + 0j  # the way: tangent at the end of the last move, in the work system
        self.datum, self.height, self.turn, self.scale, self.mirror = (
            0j,
            0.0,
            0.0,
            1.0,
            0,
        )  # mirror: 0, 1 X, 2 Y
        self.cycle: dict[str, float] = {}
        self.run(0, len(self.lines))

    def run(self, first: int, last: int) -> None:
        """Lines from `first` to before `last`; LBL 0 returns."""
        at, repeated = first, {}
        while at < last:
            line = self.lines[at]
            at += 1
            if line == "LBL 0" and first:
                return
            if found := re.fullmatch(r"CALL LBL (\d+)(?: REP(\d+))?", line):
                label = self.lines.index(f"LBL {found[1]}")
                if found[2] is None:
                    self.run(label, len(self.lines))
                elif repeated.setdefault(at, int(found[2])) > 0:
                    repeated[at] -= 1
                    at = label
                else:
                    del repeated[at]
            elif found := re.fullmatch(r"FN \d+: IF (\S+) (EQU|NE|GT|LT) (\S+) GOTO LBL (\d+)", line):
                a, b = self.value(found[1]), self.value(found[3])
                if {"EQU": a == b, "NE": a != b, "GT": a > b, "LT": a < b}[found[2]]:
                    at = self.lines.index(f"LBL {found[4]}")
            elif line in ("M30", "END PGM T MM", "END PGM T INCH"):
                return
            else:
                self.line(line)

    def value(self, text: str) -> float:
        """A number, a parameter, or a sum of these."""
        for name, known in self.q.items():
            text = re.sub(rf"{name}\b", repr(known), text)
        degrees = {"SIN": lambda a: math.sin(math.radians(a)), "COS": lambda a: math.cos(math.radians(a))}
        text = re.sub(r"(SIN|COS) ([-\d.e]+)", r"\1(\2)", text)
        return float(eval(text, {"__builtins__": {}}, degrees))

    def line(self, line: str) -> None:
        """One line that is no jump."""
        if found := re.fullmatch(r"(Q\d+) = (.*)", line):
            self.q[found[1]] = self.value(found[2])
        elif found := re.match(r"CYCL DEF 200.*", line):
            self.cycle = {name: float(value) for name, value in re.findall(r"(Q\d+)=([-+\d.]+)", line)}
        elif line.startswith("CYCL DEF"):
            self.frame(line)
        elif line == "CYCL CALL":
            self.drill()
        else:
            given = {
                name: self.value(value)
                for name, value in WORD.findall(line.replace("DR+", "").replace("DR-", ""))
            }
            code = line.split(" ")[0]
            if code == "CC":
                self.pole = self.inner(self.end(given, self.pole_before()))
            elif code in ("L", "LP", "C", "CP", "CR", "CT"):
                self.move(code, given, rapid="FMAX" in line, left="DR+" in line)

    def frame(self, line: str) -> None:
        """Cycles 7, 8, 10 and 11; the pole is one of programmed coordinates."""
        words = line.split(" ")[2:]
        if words[0] in ("7.1", "7.2", "7.3"):
            value = float(words[1][1:])
            if words[1][0] == "Z":
                self.height = value
            else:
                self.datum = (
                    complex(value, self.datum.imag) if words[1][0] == "X" else complex(self.datum.real, value)
                )
        elif words[0] == "8.1":
            self.mirror = " XY".index(words[1]) if len(words) > 1 else 0
        elif words[0] == "10.1":
            self.turn = self.turn + float(words[1][4:]) if words[1][0] == "I" else float(words[1][3:])
        elif words[0] == "11.1":
            self.scale = float(words[2])

    def outer(self, point: complex) -> complex:
        """Where a programmed point is."""
        mirrored = {0: point, 1: -point.conjugate(), 2: point.conjugate()}[self.mirror]
        return self.datum + cmath.rect(self.scale, math.radians(self.turn)) * mirrored

    def inner(self, place: complex) -> complex:
        """The programmed point that is there."""
        point = (place - self.datum) / cmath.rect(self.scale, math.radians(self.turn))
        return {0: point, 1: -point.conjugate(), 2: point.conjugate()}[self.mirror]

    def pole_before(self) -> complex:
        """Incremental words of CC count from where the tool is."""
        return self.inner(self.place)

    def end(self, given: dict[str, float], before: complex) -> complex:
        """The place of X, Y, IX and IY."""
        x = given.get("X", before.real + given.get("IX", 0.0))
        return self.outer(complex(x, given.get("Y", before.imag + given.get("IY", 0.0))))

    def move(self, code: str, given: dict[str, float], *, rapid: bool, left: bool) -> None:
        """A straight move or an arc."""
        here = self.inner(self.place)
        inner_z = (self.z - self.height) / self.scale
        z = given["Z"] if "Z" in given else inner_z + given.get("IZ", 0.0)
        height = self.height + self.scale * z
        turned = 0.0
        if code in ("LP", "CP"):
            spoke = here - self.pole
            radius = given.get("PR", abs(spoke) + given.get("IPR", 0.0))
            angle = given.get("PA", math.degrees(cmath.phase(spoke)) + given.get("IPA", 0.0))
            end = self.outer(self.pole + cmath.rect(radius, math.radians(angle)))
        else:
            end = self.end(given, here)
        mirrored = -1.0 if self.mirror else 1.0
        if code == "CP" and "IPA" in given:
            turned = math.radians(given["IPA"]) * mirrored
        elif code in ("C", "CP"):
            turned = self.turned(end, self.outer(self.pole), (1.0 if left else -1.0) * mirrored)
        elif code == "CR":
            chord, radius = abs(end - self.place), given["R"] * self.scale
            half = math.asin(min(chord / 2.0 / abs(radius), 1.0))
            turned = (
                (2.0 * half if radius > 0 else 2.0 * (math.pi - half)) * (1.0 if left else -1.0) * mirrored
            )
        elif code == "CT":
            turned = 2.0 * cmath.phase((end - self.place) / self.way)
        self.go(0 if rapid else 1, end, height, turned)

    def turned(self, end: complex, centre: complex, sign: float) -> float:
        """By what an arc about a centre turns; a full turn where it ends where it begins."""
        angle = sign * cmath.phase((end - centre) / (self.place - centre)) % (2.0 * math.pi)
        return sign * (angle if 1e-9 < angle < 2.0 * math.pi - 1e-9 else 2.0 * math.pi)

    def drill(self) -> None:
        """Cycle 200 with one infeed, and the same clearance before and behind."""
        clear = self.height + self.scale * (self.cycle["Q203"] + self.cycle["Q200"])
        bottom = self.height + self.scale * (self.cycle["Q203"] + self.cycle["Q201"])
        for kind, z in ((0, clear), (1, bottom), (0, clear)):
            self.go(kind, self.place, z, 0.0)

    def go(self, kind: int, end: complex, z: float, turned: float) -> None:
        """Keep a move, and the way in which it ends."""
        unit, chord = 25.4 if self.inch else 1.0, end - self.place
        if abs(chord) > 1e-9:
            self.way = chord / abs(chord) * cmath.rect(1.0, turned / 2.0)
        kind = kind if not turned else 3 if turned > 0 else 2
        self.place, self.z = end, z
        self.moves.append((kind, end.real * unit, end.imag * unit, z * unit, turned))
