"""A second reading of Fanuc's mills, plain and slow: one line after the other, every value in a dictionary.

It knows G0 to G3 with R or I J, G17, G20, G21, G43, G49, G52, G54 to G59, G68, G69, G80, G81 to G83 with K,
G90, G91, G98, G99, M98 and M99 in one file, G65 with letters, IF GOTO, WHILE DO END, and sums of parameters.
Every move ends at a place (x, y, z); an arc has the angle that it turns by, too.
"""

from __future__ import annotations

import math
import re

WORD = re.compile(r"([A-Z])(\[(?:[^\[\]]|\[[^\]]*\])*\]|-?[\d.]+|#\d+)")
ARGUMENTS = dict(zip("ABCIJKDEF", (1, 2, 3, 4, 5, 6, 7, 8, 9), strict=True)) | {"X": 24, "Y": 25, "Z": 26}


class SlowFanuc:
    """Reads `text`; `moves` are (kind, x, y, z, angle) in mm, kind 0 to 3."""

    def __init__(self, text: str, origins: dict[str, tuple[float, float, float]]):
        self.programs: dict[str, list[str]] = {}
        self.origins = {name: list(origin) for name, origin in origins.items()}
        self.moves: list[tuple[float, ...]] = []
        self.shared: dict[int, float] = {}
        self.here = [0.0, 0.0, 0.0]
        self.unit, self.absolute, self.motion, self.system = 1.0, True, 0, "G54"
        self.shift, self.length = [0.0] * 3, 0.0
        self.turn: tuple[float, float, float] | None = None  # centre and angle of G68
        self.cycle: dict[str, float] = {}
        self.to_level, self.level = True, 0.0
        name = ""
        for line in text.splitlines():
            number = re.fullmatch(r"O(\d+)", line.strip())
            name = str(int(number[1])) if number else name
            self.programs.setdefault(name, []).append("" if number else line.strip())
        self.run(next(iter(self.programs)), {})

    def run(self, name: str, own: dict[int, float]) -> None:
        """A program from its first line to M30 or M99."""
        lines, at = self.programs[name], 0
        while at < len(lines):
            line = lines[at]
            if found := re.fullmatch(r"IF\[(.*)\]GOTO(\d+)", line):
                at = self.block(lines, found[2]) if self.true(found[1], own) else at + 1
            elif found := re.fullmatch(r"GOTO(\d+)", line):
                at = self.block(lines, found[1])
            elif found := re.fullmatch(r"WHILE\[(.*)\]DO(\d)", line):
                at = at + 1 if self.true(found[1], own) else lines.index(f"END{found[2]}", at) + 1
            elif found := re.fullmatch(r"END(\d)", line):
                at = max(k for k in range(at) if lines[k].endswith(f"DO{found[1]}"))
            elif found := re.fullmatch(r"#(\d+)=(.*)", line):
                self.names(int(found[1]), own)[int(found[1])] = self.value(found[2], own)
                at += 1
            elif line in ("M99", "M30"):
                return
            else:
                self.line(re.sub(r"^N\d+", "", line), own)
                at += 1

    @staticmethod
    def block(lines: list[str], number: str) -> int:
        """The line with that block number."""
        return next(k for k, line in enumerate(lines) if re.match(rf"N{number}(?!\d)", line))

    def names(self, number: int, own: dict[int, float]) -> dict[int, float]:
        """Where a parameter is kept."""
        return own if number <= 33 else self.shared

    def true(self, text: str, own: dict[int, float]) -> bool:
        """A condition."""
        first, sign, second = re.split(r"(EQ|NE|GT|GE|LT|LE)", text)
        a, b = self.value(first, own), self.value(second, own)
        return {"EQ": a == b, "NE": a != b, "GT": a > b, "GE": a >= b, "LT": a < b, "LE": a <= b}[sign]

    def value(self, text: str, own: dict[int, float]) -> float:
        """A sum of products of numbers and parameters, with functions of degrees."""

        def parameter(found: re.Match[str]) -> str:
            number = int(found[1])
            return repr(self.names(number, own).get(number, 0.0))

        text = re.sub(r"#(\d+)", parameter, text).replace("[", "(").replace("]", ")")
        degrees = {"SIN": lambda a: math.sin(math.radians(a)), "COS": lambda a: math.cos(math.radians(a))}
        return float(eval(text, {"__builtins__": {}}, degrees | {"SQRT": math.sqrt, "ABS": abs}))

    def line(self, text: str, own: dict[int, float]) -> None:
        """A line of words."""
        words = [(letter, self.value(number, own)) for letter, number in WORD.findall(text)]
        codes = {f"{letter}{number:g}" for letter, number in words if letter in "GM"}
        given = {letter: number for letter, number in words if letter not in "GM"}
        if "M98" in codes:
            for _ in range(int(given.get("L", 1))):
                self.run(f"{given['P']:.0f}", own)
            return
        if "G65" in codes:
            self.run(f"{given['P']:.0f}", {ARGUMENTS[c]: v for c, v in given.items() if c in ARGUMENTS})
            return
        self.unit = 25.4 if "G20" in codes else 1.0 if "G21" in codes else self.unit
        self.absolute = "G90" in codes or (self.absolute and "G91" not in codes)
        self.to_level = "G98" in codes or (self.to_level and "G99" not in codes)
        self.system = next((c for c in codes if re.fullmatch(r"G5[4-9]", c)), self.system)
        if "G43" in codes:
            self.length = self.origins[f"T{given.get('H', 0):g}"][2]
        self.length = 0.0 if "G49" in codes else self.length
        if "G52" in codes:
            for axis, letter in enumerate("XYZ"):
                self.shift[axis] = given.get(letter, self.shift[axis] / self.unit) * self.unit
            return
        if "G68" in codes:
            self.turn = (given["X"] * self.unit, given["Y"] * self.unit, given["R"])
            return
        self.turn = None if "G69" in codes else self.turn
        for code, motion in (
            ("G0", 0),
            ("G1", 1),
            ("G2", 2),
            ("G3", 3),
            ("G81", 81),
            ("G82", 82),
            ("G83", 83),
        ):
            if code in codes:
                self.motion, self.cycle = motion, {} if motion < 81 or self.motion < 81 else self.cycle
                self.level = self.place()[2]
        if "G80" in codes:
            self.motion, self.cycle = 0, {}
        if given.keys() & set("XYZ") or (self.motion in (2, 3) and given.keys() & set("IJ")):
            self.move(given)

    def place(self) -> list[float]:
        """The programmed coordinates of where the tool is [mm]."""
        return list(self.programmed)

    programmed = (0.0, 0.0, 0.0)

    def move(self, given: dict[str, float]) -> None:
        """A straight move, an arc or a cycle."""
        here = self.programmed
        words = {c: given[c] * self.unit for c in given if c in "XYZIJRQ"}
        end = [words.get(c, None if self.absolute else 0.0) for c in "XYZ"]
        to = [h if e is None else e if self.absolute else h + e for e, h in zip(end, here, strict=True)]
        if self.motion >= 81:
            self.drill(words, int(given.get("K", 1)), to)
            return
        angle = 0.0
        if self.motion in (2, 3):
            angle = self.angle(here, to, words)
        self.go(self.motion, to, angle)

    def angle(self, here: tuple[float, ...], to: list[float], words: dict[str, float]) -> float:
        """By what an arc turns [rad], positive counter-clockwise."""
        start, end = complex(*here[:2]), complex(*to[:2])
        way = 1.0 if self.motion == 3 else -1.0
        if "R" in words:
            half = math.asin(min(abs(end - start) / 2.0 / abs(words["R"]), 1.0))
            return way * (2.0 * half if words["R"] > 0 else 2.0 * (math.pi - half))
        centre = start + complex(words.get("I", 0.0), words.get("J", 0.0))
        turned = math.atan2(
            ((end - centre) / (start - centre)).imag, ((end - centre) / (start - centre)).real
        )
        turned = way * turned % (2.0 * math.pi)
        return way * (turned if turned > 1e-9 else 2.0 * math.pi)

    def drill(self, words: dict[str, float], times: int, to: list[float]) -> None:
        """A cycle at one place, or `times` in steps of G91."""
        if "R" in words:
            self.cycle["R"] = words["R"] + (0.0 if self.absolute else self.level)
        if "Z" in words:
            self.cycle["Z"] = words["Z"] + (0.0 if self.absolute else self.cycle["R"])
        step = [to[0] - self.programmed[0], to[1] - self.programmed[1]]
        top, bottom = self.cycle["R"], self.cycle["Z"]
        for n in range(times):
            there = to[:2] if n == 0 else [self.programmed[0] + step[0], self.programmed[1] + step[1]]
            self.go(0, [*there, self.programmed[2]], 0.0)
            self.go(0, [*there, top], 0.0)
            self.go(1, [*there, bottom], 0.0)
            self.go(0, [*there, max(self.level, top) if self.to_level else top], 0.0)

    def go(self, kind: int, to: list[float], angle: float) -> None:
        """Keep a move to a programmed place."""
        self.programmed = (to[0], to[1], to[2])
        point = complex(to[0], to[1])
        if self.turn is not None:
            centre = complex(*self.turn[:2])
            point = centre + (point - centre) * complex(
                math.cos(math.radians(self.turn[2])), math.sin(math.radians(self.turn[2]))
            )
        origin = self.origins[self.system]
        x, y = point.real + origin[0] + self.shift[0], point.imag + origin[1] + self.shift[1]
        self.moves.append((kind, x, y, to[2] + origin[2] + self.shift[2] + self.length, angle))
