"""Subprograms of a Sinumerik program: files of their own in the program's folder.

    NAME            call NAME.SPF (or .MPF); NAME P3 three times; NAME(1, R2) with values
    CALL "NAME"     the same, for names that begin with digits
    L10             call L10.SPF
    PROC NAME(REAL A, INT B)    the first line of a subprogram: its variables, which get the values of the call
    M17, RET, M30   its end

Variables of DEF are a call's own; R parameters are shared. Calls of the reader hand values over in shared names.
"""

from __future__ import annotations

import re

from planner.nc.language.siemens import codes
from planner.nc.language.siemens.commands import TYPES, Commands
from planner.nc.language.siemens.text import LineTokens, handed_over, variable
from planner.nc.language.tree import ONE, ZERO, Call, Expression, Number, Parameter, Return, assign

_CALLED = re.compile(r"[A-Z_]{2}\w*|L\d+")
# Commands and cycles of the control, which are no files.
_OF_THE_CONTROL = re.compile(
    r"CYCLE\d+|POCKET\d|SLOT\d|HOLES\d|LONGHOLE|RND|RNDM|CHF|CHR|POLY|BSPLINE|ASPLINE|CSPLINE|SPLINEPATH|CIP|CT|INVCW|INVCCW|"
    r"TANG\w*|TRA\w*|COUP\w*|G\d+|DISR|DISCL|ANG|AP|RP|OFFN|FB|FA|SETPIECE|EXTCALL|PCALL|MCALL|STOPRE|ORI\w*|A3|B3|C3|LEAD|TILT|STR\w*"
)
_TIMES = re.compile(r"P(\d+)")
_NAMES_MAX = 32  # parameters of a subprogram


class Calls(Commands):
    """Calls and what they hand over."""

    def _is_call(self, reader: LineTokens) -> bool:
        """True if the line is a call by a name."""
        name = reader.peek()
        if (
            reader.tokens[reader.next].kind != "name"
            or not _CALLED.fullmatch(name)
            or name in self.names | codes.IDLE | codes.IDLE_CALLS | codes.SAID.keys()
        ):
            return False
        behind = reader.peek(1)
        return not _OF_THE_CONTROL.fullmatch(name) and (behind in ("", "(") or bool(_TIMES.fullmatch(behind)))

    def _call(self, reader: LineTokens) -> None:
        """NAME, NAME P3, NAME(values)."""
        name = reader.peek()
        reader.next += 1
        times: Expression = ONE
        given = self._arguments(reader)
        if match := _TIMES.fullmatch(reader.peek()):
            reader.next += 1
            times = Number(float(match.group(1)))
        if not reader.ended:
            raise reader.fault(f"{reader.peek()} is not expected behind the call of {name}")
        self._append_call(reader, name, given, times)

    def _call_text(self, reader: LineTokens) -> None:
        """CALL "NAME"."""
        text = reader.peek().strip('"')
        if reader.ended or reader.tokens[reader.next].kind != "text":
            raise reader.fault('CALL is followed by the name of a subprogram: CALL "HOLES"')
        reader.next += 1
        name = re.sub(
            r"(?i)(_SPF|\.SPF|_MPF|\.MPF)\Z",
            "",
            re.sub(r"(?i)\A_N_", "", text.replace("\\", "/").split("/")[-1]),
        )
        self._append_call(reader, name.upper(), [], ONE)

    def _append_call(
        self, reader: LineTokens, name: str, given: list[Expression | None], times: Expression
    ) -> None:
        if len(given) > _NAMES_MAX:
            raise reader.fault(f"a subprogram takes at most {_NAMES_MAX} values", 0)
        handed: list[tuple[Parameter, Expression]] = [
            (handed_over(k), given[k] if k < len(given) and given[k] is not None else ZERO)  # type: ignore[misc]
            for k in range(_NAMES_MAX if given else 0)
        ]
        if handed:
            self.body.append(assign(reader.place, *handed))
        self.body.append(Call(reader.place, name.lower(), None, name, times))

    def _procedure(self, reader: LineTokens) -> None:
        """PROC NAME(REAL A, INT B)."""
        if reader.ended or reader.tokens[reader.next].kind != "name":
            raise reader.fault("PROC is followed by the subprogram's name")
        reader.next += 1
        taken: list[tuple[Parameter, Expression]] = []
        if reader.take("("):
            while not reader.take(")"):
                kind, name = reader.peek(), reader.peek(1)
                if kind not in TYPES or reader.ended:
                    raise reader.fault(f"a value of PROC is one of {', '.join(sorted(TYPES))} and a name")
                reader.next += 2
                self.names.add(name)
                taken.append((variable(name), handed_over(len(taken))))
                if not reader.take(",") and reader.peek() != ")":
                    raise reader.fault(") is missing")
        reader.next = len(reader.tokens)  # SAVE, DISPLOF and others
        if taken:
            self.body.append(assign(reader.place, *taken))

    def _return(self, reader: LineTokens) -> None:
        """RET."""
        self.body.append(Return(reader.place))


def siemens_files(name: str) -> frozenset[str]:
    """Names that the file of a subprogram may have, in small letters: NAME.SPF, NAME.MPF, and as controls save them, NAME_SPF."""
    return frozenset(name + ending for ending in (".spf", ".mpf", "_spf", "_mpf", ""))
