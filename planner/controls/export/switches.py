"""The words of a line beside its move, in the words of a control: tool, spindle, coolant, modes, dwells,
stops, codes of other kinds."""

from planner.base.units import MILLISECOND
from planner.controls.export.controls import is_setting
from planner.controls.export.output import Output, called, comment
from planner.controls.export.rows import COMPENSATION_OFF, COMPENSATION_ON, ENDS, LENGTHS, Row, Word
from planner.nc import codes
from planner.nc.program import plain

_SPINDLE, _SPINDLE_OFF = (3, 4), 5
_COOLANT, _COOLANT_OFF = (7, 8), 9
_STOPS = (0, 1, 60)
_G96, _G80 = 960, 800


class Switches(Output):
    """An `Output` that takes what lines say beside their moves."""

    tool = ""  # the last T word
    ended = False  # by M2 or M30
    coolant = False  # on

    def _other(self, row: Row, words: list[Word]) -> None:
        """A code that is none of RS274NGC's moves and modes."""
        first, text = words[0], " ".join(map(str, words))
        name = f"{first.letter}{codes.number(first.code)}"
        if first.letter in "%O":
            if first.letter == "O":
                self._note("O", f"the program number {first} is left out", row)
        elif (macro := self.machine.macros.get(name)) is not None:
            self._say(called(macro, words[1:]))
        elif is_setting(words, self.control):
            self._option(name, row)
            self._say(text)
        elif name in self.program.reading.ignore:
            self._note(name, f"{name} is left out, as --ignore says", row)
        elif why := self.control.idle.get(name) or self.control.unheard.get(name, ("", ""))[1]:
            self._note(name, f"{text} is left out: {why}", row)
        else:
            self._refuse(row, text)

    def _switches(self, row: Row) -> None:
        """T, M6, the spindle, coolant and the other M codes that come before a move."""
        tool, macros = row.value("T"), self.machine.macros
        if tool is not None:
            self.tool = str(tool)
            if tool.value > self.control.tool_max:
                highest = f"the control counts to T{self.control.tool_max:g}"
                self._note("T", f"{self.tool} is left out: {highest}", row)
            elif "T" in self.control.letters:
                changes = 6 in row.m() and 6 in self.control.m and "M6" not in macros
                self._say(f"{self.tool} M6" if changes else self.tool)
            elif 6 not in row.m():
                self._note("T", f"{self.tool} is left out: it chooses a tool, and M6 changes it", row)
        for code in row.m():
            name = f"M{code}"
            macro = macros.get(name)
            if code * 10 in ENDS or code in _STOPS:
                continue
            self.coolant = code != _COOLANT_OFF and (self.coolant or code in _COOLANT)
            if code in (*_SPINDLE, _SPINDLE_OFF):
                self._turn(row, code, macro)
            elif code == 6:
                self._change(row, macro, said=tool is not None)
            elif macro is not None:
                self._say(called(macro, []))
            elif code in self.control.m:
                self._option(name, row)
                self._say(_with_own(row, name, codes.WORDS.get(("M", code * 10), "")))
            elif code == _COOLANT_OFF and name not in self.control.idle and not {"M7", "M8"} & macros.keys():
                self._note(name, "M9 is left out: nothing has switched a coolant on", row)
            else:
                self._idle(row, name)

    def _idle(self, row: Row, name: str) -> None:
        """A code that changes nothing on this control; any other one is refused."""
        if name not in self.control.idle:
            self._refuse(row, name)
        self._note(name, f"{name} is left out: {self.control.idle[name]}", row)

    def _turn(self, row: Row, code: int, macro: str | None) -> None:
        """The spindle or the laser, on or off, with the speed that waits for it."""
        turns = code != _SPINDLE_OFF and _G96 not in row.g()
        speed = [self.speed] if self.speed is not None and turns else []
        if macro is not None:
            self._say(called(macro, speed))
        elif code in self.control.m:
            self._option("M3", row)
            self._say(" ".join([f"M{code}", *map(str, speed)]))
        elif code == _SPINDLE_OFF and not self.spindle:
            self._note("M5", "M5 is left out: nothing has switched the spindle on", row)
        else:
            self._refuse(row, f"M{code}")
        self.speed = None if speed else self.speed
        self.spindle = 0 if code == _SPINDLE_OFF else code

    def _change(self, row: Row, macro: str | None, *, said: bool) -> None:
        if macro is not None:
            self._say(called(macro, [Word("T", 0.0, self.tool[1:])] if self.tool else []))
        elif 6 in self.control.m:
            if not said:
                self._say("M6")
        else:
            pause = self.control.instead["M6"]
            self._option(pause, row)
            what = f"{pause} for the tool change: change to {self.tool or 'the tool'} by hand, set its zero, go on"
            self._note("M6", what, row)
            self._say(comment(f"tool change: {self.tool or 'T'}", self.control))
            self._say(pause)

    def _modes(self, row: Row) -> None:
        """The modal G codes of a row; the distance mode waits until it matters."""
        said = []
        for code in row.g():
            group, name = codes.G_GROUP[code], f"G{codes.number(code)}"
            if group == "distance mode" and self.extrudes:  # after G91 E is a step, and Marlin's G90 ends M83
                if row.others:
                    self._refuse(row, f"{name} beside other codes")
                self._say(name)
                self.absolute = row.absolute
            if group in ("motion", "one-shot", "distance mode"):
                continue
            if not self.control.cycles and (code == _G80 or group == "cutter compensation"):
                if code in COMPENSATION_ON:
                    self._know_diameter(row, code)
                    self._note("G41", f"{name} is left out: the tool's radius is in the moves", row)
                elif code == COMPENSATION_OFF and code in self.control.g:
                    said.append(name)
            elif group == "spindle mode" and code in self.control.g:
                self._say(_with_own(row, name, "SD"))
                self.speed = None if row.value("S") is not None else self.speed
            elif code in self.control.g:
                own = codes.WORDS.get(("G", code), "") + "XYZ" * (code in LENGTHS)
                said.append(_with_own(row, name, own))
                self.inch = code == 200 if group == "units" else self.inch
                self.feed = None if group in ("units", "feed mode") else self.feed
            elif code != 200:  # lengths are written in mm
                self._idle(row, name)
        for text in [" ".join(said)] if said and not self.control.one_command else said:
            self._say(text)

    def _know_diameter(self, row: Row, code: int) -> None:
        """Refuse the radius of a tool without a diameter: its centre would go along the contour."""
        word = row.value("D")
        number = word.text if word is not None else self.tool[1:]
        tool = self.machine.tools.get(str(int(float(number)))) if number else None
        given = code in (411, 421) and word is not None  # the diameter itself
        if not given and (tool is None or not tool.diameter):
            self._refuse(row, f"G{codes.number(code)} of a tool whose diameter the machine file does not say")

    def _say_dwell(self, seconds: float) -> None:
        self._flush_speed()
        lasts = round(seconds / MILLISECOND, 3) if self.control.milliseconds else round(seconds, 6)
        self._say(f"G4 P{plain(lasts)}")

    def _stops(self, row: Row) -> None:
        for code in row.m():
            name = f"M{code}"
            if code * 10 in ENDS:
                self._end(row, name)
            elif code in _STOPS:
                text = self.machine.macros.get(name) or self.control.instead.get(name, name)
                self._option(text, row)
                self._flush_speed()
                self._say(text)

    def _end(self, row: Row, said: str = "") -> None:
        """The end of the program, M2 and M30 where they are known; spindle and coolant do not outlive it."""
        self.ended = True
        macro = self.machine.macros.get(said, "")
        known = not macro and bool(said) and int(said[1:]) in self.control.m
        for on, name in ((self.spindle, "M5"), (self.coolant, "M9")):
            if not on or known or self.control.end == "M2":
                continue
            text = self.machine.macros.get(name, name if int(name[1:]) in self.control.m else "")
            if text:
                self._say(text)
            elif not macro:
                self._refuse(row, f"{name}, as which {said or 'the end'} acts,")
        self._say(macro or (said if known else self.control.end))


def _with_own(row: Row, name: str, letters: str) -> str:
    """A code with the words of its row that are its own."""
    return " ".join([name, *(str(word) for word in row.words if word.letter in letters)])
