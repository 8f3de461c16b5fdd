"""Random programs of everything: sections of cycles, offsets, feeds, lathes, arcs and splines in subprograms, loops and branches.

Their numbers are partly computed; there are line numbers, comments and lines without blanks.
"""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
from random_nc import cycles, feeds, lathe, offsets
from random_splines import random_splines
from test_agreement import random_program

Rng = np.random.Generator
# What one section leaves and the next does not expect. (A G92 offset and a turned system in force together move LinuxCNC's next move.)
TURNED_BACK = "\n".join(f"G10 L2 P{system} R0" for system in range(1, 10))
RESET = f"G80 G40\nG92.1\n{TURNED_BACK}\nG54 G49\nG21 G90 G91.1 G17 G94 G8 G99 F100\nM3 S1\nG0 X0 Y0 Z20"
_NUMBER = re.compile(r"(?<=[XYZIJRQKF])(-?\d+\.?\d*)")
_SIGNALS = (
    "M62 P1",
    "M63 P2",
    "M64 P1",
    "M65 P3",
    "M67 E1 Q2.5",
    "M68 E0 Q0.25",
    "M7",
    "M8",
    "M9",
    "M48",
    "M49",
    "G64 P0.05",
    "G61",
)


def together(rng: Rng) -> str:
    """A program of two to four sections."""
    subs, body = [], ["G21 G90 G17 F100", "#<one>=1 #3=2.5 #<_two>=2"]
    makers: tuple[Callable[[Rng], str], ...] = (cycles, offsets, feeds, lathe, _moves, random_splines)
    for k in range(int(rng.integers(2, 5))):
        section = RESET.split("\n") + _computed(
            rng, makers[int(rng.integers(len(makers)))](rng).removesuffix("\nM2\n").split("\n")
        )
        before, inside, after = _around(rng, 100 * (k + 1))
        if inside == "sub":
            subs += [f"o{100 * (k + 1)} sub", *section, f"o{100 * (k + 1)} endsub"]
            body += before
        else:
            body += [*before, *section, *after]
    return "\n".join([*subs, *_written(rng, body), "M2", ""])


def _moves(rng: Rng) -> str:
    """Arcs and lines, without tool lengths: they are a length in other units here after G20 (see `random_program`)."""
    text = random_program(rng)
    return "\n".join(line for line in text.split("\n") if "G43" not in line and "G49" not in line)


def _around(rng: Rng, label: int) -> tuple[list[str], str, list[str]]:
    """What a section stands in: the lines before it, "sub" if it is called, and the lines after it."""
    kind = int(rng.integers(7))
    if kind == 0:
        return [f"o{label} repeat [{rng.integers(1, 3)}]"], "", [f"o{label} endrepeat"]
    if kind == 1:
        return [f"o{label} if [#3 GT {rng.choice(['1', '9'])}]"], "", [f"o{label} endif"]
    if kind == 2:
        head = [f"#{label}=0", f"o{label} while [#{label} LT {rng.integers(1, 3)}]"]
        return head, "", [f"#{label}=[#{label}+1]", f"o{label} endwhile"]
    if kind == 3:
        return [f"o{label} call [1.5] [2]"], "sub", []
    if kind == 4:
        return [f"o{label} do"], "", [f"o{label} while [#3 LT 0]"]
    return [], "", []


def _computed(rng: Rng, lines: list[str]) -> list[str]:
    """The lines with some of their numbers as expressions of the same value."""

    def of(found: re.Match[str]) -> str:
        text = found.group(1)
        choice = rng.random()
        if choice < 0.08:
            return f"[{text}]"
        if choice < 0.12:
            return f"[{text}*#<_two>/2]"
        if choice < 0.15:
            return f"[#<_two>*0.5*{text}]"
        return text

    return [_NUMBER.sub(of, line) for line in lines]


def _written(rng: Rng, lines: list[str]) -> list[str]:
    """The lines as people write them."""
    out = []
    for n, line in enumerate(lines):
        text = line
        choice = rng.random()
        plain = not line.startswith(("o", "#"))
        if choice < 0.05 and plain:
            text = f"N{10 * n} {line}"
        elif choice < 0.1:
            text = f"{line} (a comment)"
        elif choice < 0.13 and plain:
            text = line.lower()
        elif choice < 0.16 and plain:
            text = line.replace(" ", "")
        elif choice < 0.21 and plain:
            out.append(str(rng.choice(_SIGNALS)))
        out.append(text)
    return out
