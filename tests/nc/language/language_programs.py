"""Programs made by chance over LinuxCNC's language: parameters, expressions, O words, calls, questions about the state.

Every program ends: loops count, and words are kept small by MOD. With `risky`, programs may fail on the way (division by zero).
"""

from __future__ import annotations

import numpy as np

from planner.nc.program import Program

LINE_MAX = 250  # LinuxCNC reads lines of 255 characters
_ONE = ("ABS", "SIN", "COS", "TAN", "FIX", "FUP", "ROUND", "EXP", "SQRT", "LN", "ASIN", "ACOS")
_TWO = ("+", "-", "*", "/", "MOD", "**", "EQ", "NE", "GT", "GE", "LT", "LE", "AND", "OR", "XOR")
_ASKED = (
    "#5420", "#5421", "#5422", "#<_x>", "#<_y>", "#<_z>", "#<_feed>", "#<_metric>", "#<_absolute>", "#<_line>", "#<_motion_mode>",
    "#<_plane>", "#<_rpm>", "#<_spindle_on>", "#<_coord_system>", "#<_call_level>", "#5220", "#<_ijk_absolute_mode>", "#<_imperial>",
    "#<_incremental>", "#<_units_per_minute>", "#<_spindle_cw>", "#<_mist>", "#<_flood>", "#<_vmajor>", "#<_value>",
)  # fmt: skip


class Generator:
    """One random program; `text()` makes it. With `risky`, operations may be undefined for their numbers."""

    def __init__(self, rng: np.random.Generator, *, risky: bool = False):
        self.rng, self.risky = rng, risky
        self.label = 100
        self.names = ["#<a>", "#<depth>", "#<_shared>"]
        self.subs: list[tuple[str, int]] = []
        self.loops: list[tuple[str, str]] = []  # labels and kinds of the while and do loops around
        self.in_sub = False
        self.counters = 0

    def pick(self, of: list | tuple) -> object:
        return of[int(self.rng.integers(len(of)))]

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    # --- expressions ----------------------------------------------------------------------------------------------------------

    def number(self) -> str:
        kind = self.rng.integers(4)
        if kind == 0:
            return str(self.rng.integers(0, 10))
        if kind == 1:
            return f"{self.rng.uniform(0, 5):.3f}"
        if kind == 2:
            return f".{self.rng.integers(1, 99)}"
        return f"{self.rng.integers(0, 20)}."

    def parameter(self) -> str:
        kind = self.rng.integers(8)
        if kind < 3:
            return f"#{self.rng.integers(1, 8)}"
        if kind == 3:
            return f"#{self.rng.integers(31, 40)}"
        if kind == 4:
            return str(self.pick(self.names))
        if kind == 5:
            return f"#[{self.rng.integers(1, 5)}+{self.rng.integers(0, 3)}]"
        if kind == 6:
            return "##40"
        return str(self.pick(_ASKED))

    def value(self, depth: int = 0) -> str:
        """What may stand in a word."""
        kind = self.rng.integers(10)
        sign = self.pick(("", "", "", "-", "+"))
        if depth > 3 or kind < 3:
            return f"{sign}{self.number()}"
        if kind < 6:
            return f"{sign}{self.parameter()}"
        if kind < 9:
            return f"{sign}[{self.expression(depth + 1)}]"
        return f"{sign}{self.function(depth + 1)}"

    def function(self, depth: int) -> str:
        name = str(self.pick(_ONE))
        inner = self.expression(depth + 1)
        if not self.risky:
            guard = {
                "SQRT": f"ABS[{inner}]", "LN": f"1+ABS[{inner}]", "ASIN": f"[[{inner}] MOD 0.97]", "ACOS": f"[[{inner}] MOD 0.97]",
                "EXP": f"[{inner}] MOD 5", "TAN": f"[[{inner}] MOD 80]",
            }  # fmt: skip
            inner = guard.get(name, inner)
        if self.chance(0.15):
            return f"ATAN[{inner}]/[{self.expression(depth + 1)}]"
        if self.chance(0.05):
            return f"EXISTS[{self.pick(self.names)}]"
        return f"{name}[{inner}]"

    def expression(self, depth: int = 0) -> str:
        text = self.value(depth)
        for _ in range(int(self.rng.integers(0, 3))):
            operator = str(self.pick(_TWO))
            right = self.value(depth + 1)
            if not self.risky:
                if operator in ("/", "MOD"):
                    right = f"[1+ABS[{right}]]"
                elif operator == "**":
                    right = str(self.rng.integers(0, 4))
            space = " " if self.chance(0.8) else ""
            text += f"{space}{operator}{space}{right}"
        return self.cased(text)

    def cased(self, text: str) -> str:
        return text.lower() if self.chance(0.3) else text

    # --- statements -----------------------------------------------------------------------------------------------------------

    def word(self, letter: str) -> str:
        if self.chance(0.25):
            return f"{letter}{self.number()}"
        if self.chance(0.2):
            return (
                f"{letter}[{self.expression()}]" if self.risky else f"{letter}[[{self.expression()}] MOD 100]"
            )
        return f"{letter}[[{self.expression()}] MOD 100]"

    def move(self) -> list[str]:
        axes = [a for a in "XYZ" if self.chance(0.5)] or ["X"]
        code = str(self.pick(("G1 ", "G0 ", "", "G[1-#30*0] ")))
        if "#30" in code:
            code = "G[2-1] "
        words = " ".join(self.word(axis) for axis in axes)
        feed = f" F[100+ABS[[{self.expression()}] MOD 500]]" if self.chance(0.2) else ""
        assign = f" #{self.rng.integers(1, 8)}={self.value()}" if self.chance(0.15) else ""
        return [self.cased(f"{code}{words}{feed}{assign}")]

    def assignment(self) -> list[str]:
        kind = self.rng.integers(6)
        if kind < 3:
            target = f"#{self.rng.integers(1, 8)}"
        elif kind == 3:
            target = f"#{self.rng.integers(31, 40)}"
        elif kind == 4:
            target = str(self.pick(self.names))
        else:
            target = f"#[{self.rng.integers(1, 5)}+{self.rng.integers(0, 3)}]"
        value = f"[[{self.expression()}] MOD 1000]"
        text = f"{target}={value}"
        if self.chance(0.2):
            text += f" #{self.rng.integers(1, 8)} = {self.value()}"
        return [text]

    def mode(self) -> list[str]:
        return [
            str(
                self.pick(
                    (
                        "G90",
                        "G91",
                        "G17",
                        "G18",
                        "G54",
                        "G55",
                        "G61",
                        "G64",
                        "M3 S500",
                        "M5",
                        "M8",
                        "M9",
                        "G92 X1",
                        "G92.1",
                        "F200",
                    )
                )
            )
        ]

    def arc(self) -> list[str]:
        back = "G1 G90" if self.chance(0.5) else "G1 G91"
        r = f"[1+ABS[{self.expression(2)}] MOD 5]"
        return [f"#29={r}", f"G91 G17 G{self.rng.integers(2, 4)} X[2*#29] I#29 F100", back]

    def body(self, depth: int, size: int) -> list[str]:
        lines: list[str] = []
        for _ in range(int(self.rng.integers(1, size))):
            lines += self.statement(depth)
        return lines

    def statement(self, depth: int) -> list[str]:
        kind = int(self.rng.integers(20))
        if kind < 7 or depth > 3:
            return self.move()
        if kind < 11:
            return self.assignment()
        if kind == 11:
            return self.mode()
        if kind == 12:
            return self.arc()
        if kind in (13, 14):
            return self.branch(depth)
        if kind in (15, 16):
            return self.loop(depth)
        if kind == 17 and self.subs:
            return self.call()
        if kind == 18 and self.loops:
            return self.leave()
        if kind == 19:
            return [f"(debug, #1 {self.pick(self.names)})"]
        return self.move()

    def o(self) -> str:
        self.label += 1
        return f"<l{self.label}>" if self.chance(0.3) else str(self.label)

    def branch(self, depth: int) -> list[str]:
        label = self.o()
        lines = [f"o{label} if [{self.expression()}]", *self.body(depth + 1, 4)]
        for _ in range(int(self.rng.integers(0, 2))):
            lines += [f"o{label} elseif [{self.expression()}]", *self.body(depth + 1, 3)]
        if self.chance(0.5):
            lines += [f"O{label} else", *self.body(depth + 1, 3)]
        return [*lines, f"o{label} endif"]

    def loop(self, depth: int) -> list[str]:
        label, kind = self.o(), self.rng.integers(3)
        if kind == 0:
            inside = self.inside(label, depth, "repeat")
            return [f"o{label} repeat [{self.rng.integers(0, 4)}]", *inside, f"o{label} endrepeat"]
        self.counters += 1
        counter = f"#<n{self.counters}>"
        step = f"{counter}=[{counter}+1]"
        condition = f"[{counter} LT {self.rng.integers(1, 5)}]"
        if kind == 1:
            inside = self.inside(label, depth, "while")
            return [f"{counter}=0", f"o{label} while {condition}", step, *inside, f"o{label} endwhile"]
        inside = self.inside(label, depth, "do")
        return [f"{counter}=0", f"o{label} do", step, *inside, f"o{label} while {condition}"]

    def inside(self, label: str, depth: int, kind: str) -> list[str]:
        if kind == "repeat":  # LinuxCNC has no break and continue in it
            kept, self.loops = self.loops, []
            body = self.body(depth + 1, 4)
            self.loops = kept
            return body
        self.loops.append((label, kind))
        body = self.body(depth + 1, 4)
        self.loops.pop()
        return body

    def leave(self) -> list[str]:
        label = self.o()
        inner, kind = self.loops[-1]
        # LinuxCNC 2.9 does not count the turns of a repeat around a do loop that was continued, and ends a do loop too early that
        # comes after a while loop with a break
        what = "break" if kind == "do" else "continue"
        return [f"o{label} if [{self.expression()}]", f"o{inner} {what}", f"o{label} endif"]

    def call(self) -> list[str]:
        name, wanted = self.subs[int(self.rng.integers(len(self.subs)))]
        given = int(self.rng.integers(0, wanted + 2))
        arguments = " ".join(f"[{self.expression()}]" for _ in range(given))
        lines = [f"o{name} call {arguments}"]
        if self.chance(0.3):
            lines.append("G1 X[#<_value> MOD 50] Y#<_value_returned>")
        return lines

    def subprogram(self) -> list[str]:
        label = self.o()
        kept, self.loops = self.loops, []
        self.in_sub = True
        lines = [f"o{label} sub", "#<a>=1 #<depth>=2", *self.body(1, 6)]
        if self.chance(0.4):
            inner = self.o()
            lines += [
                f"o{inner} if [{self.expression()}]",
                f"o{label} return [{self.expression()}]",
                f"o{inner} endif",
            ]
            lines += self.body(1, 3)
        end = f"o{label} endsub" + (f" [{self.expression()}]" if self.chance(0.5) else "")
        self.loops, self.in_sub = kept, False
        self.subs.append((label, 3))
        return [*lines, end]

    def text(self) -> str:
        """The program."""
        while True:
            lines = self._lines()
            if all(len(line) < LINE_MAX for line in "\n".join(lines).split("\n")):
                return "\n".join([*lines, "M2", ""])

    def _lines(self) -> list[str]:
        self.subs, self.loops = [], []
        lines = [
            "G21 G90 G17 F100", "#<a>=1 #<depth>=2", "#<_shared>=3", "#40=31", "#1=1 #2=2.5 #3=-3", "#31=7", "G1 X1 Y1 Z1",
        ]  # fmt: skip
        for _ in range(int(self.rng.integers(0, 3))):
            lines += self.subprogram()
        # LinuxCNC computes the result of a subprogram that it passes over, and leaves it in _value: a call puts that right
        lines += ["o90 sub", "o90 endsub", "o90 call"]
        lines += self.body(0, 12)
        return lines


def same(one: Program, other: Program, *, apart: float = 0.0) -> None:
    """The same motion, whatever lines it comes from."""
    for name in ("kind", "path_control", "arc_block", "arc_normal"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for name in ("end", "feed", "dwell", "arc_center", "arc_sweep"):
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=0, atol=apart, err_msg=name)
