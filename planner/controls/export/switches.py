"""The words of a line beside its move, in the words of a control: tool, spindle, coolant, modes, dwells,
stops, codes of other kinds."""

from planner.base.units import MILLISECOND
from planner.controls.export.controls import is_command, is_setting
from planner.controls.export.output import Output, called, comment
from planner.controls.export.rows import COMPENSATION_OFF, COMPENSATION_ON, ENDS, LENGTHS, Row, Word
from planner.nc import codes
from planner.nc.program import plain

_SPINDLE, _SPINDLE_OFF = (3, 4), 5
_G96, _G80 = 960, 800


class Switches(Output):
    """An `Output` that takes what lines say beside their moves."""

    tool = ""  # the last T word
    ended = False  # by M2 or M30

    def _command(self, row: Row) -> None:
        """A line that is no words: homing, a message, a command to the control."""
        if not is_command(row.text, self.control):
            self._refuse(row, row.text)
        self._say(row.text)

    def _other(self, row: Row, words: list[Word]) -> None:
        """A code that is none of RS274NGC's moves and modes."""
        first, text = words[0], "".join(map(str, words[:1])) + "".join(f" {word}" for word in words[1:])
        name = f"{first.letter}{codes.number(first.code)}"
        if first.letter in "%O":
            if first.letter == "O":
                self._note("O", f"the program number {first} is left out", row)
            return
        macro = self.machine.macros.get(name)
        if macro is not None:
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
        tool = row.value("T")
        if tool is not None:
            self.tool = str(tool)
            if "T" in self.control.letters:
                changes = 6 in row.m() and 6 in self.control.m and "M6" not in self.machine.macros
                self._say(f"{self.tool} M6" if changes else self.tool)
            elif 6 not in row.m():
                self._note("T", f"{self.tool} is left out: it chooses a tool, and M6 changes it", row)
        for code in row.m():
            name = f"M{code}"
            if code in (0, 1, 2, 30, 60):
                continue
            macro = self.machine.macros.get(name)
            if code in (*_SPINDLE, _SPINDLE_OFF):
                self._turn(row, code, macro)
            elif code == 6:
                self._change(row, macro, said=tool is not None)
            elif macro is not None:
                self._say(called(macro, []))
            elif code in self.control.m:
                self._option(name, row)
                own = codes.WORDS.get(("M", code * 10), "")
                self._say(" ".join([name, *(str(word) for word in row.words if word.letter in own)]))
            elif name in self.control.idle:
                self._note(name, f"{name} is left out: {self.control.idle[name]}", row)
            elif code == 9 and not any(f"M{on}" in self.machine.macros for on in (7, 8)):
                self._note(name, "M9 is left out: nothing has switched a coolant on", row)
            else:
                self._refuse(row, name)

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

    def _modes(self, row: Row, *, chords: bool) -> None:
        """The modal G codes of a row; the distance mode waits until it matters."""
        said = []
        for code in row.g():
            group, name = codes.G_GROUP[code], f"G{codes.number(code)}"
            if group == "distance mode" and self.extrudes:
                self._say_distance(row, name)
            if group in ("motion", "one-shot", "distance mode"):
                continue
            if code == _G80 and not self.control.cycles:
                continue
            if group == "cutter compensation" and not self.control.cycles:
                if code in COMPENSATION_ON:
                    self._know_diameter(row, code)
                    self._note("G41", f"{name} is left out: the tool's radius is in the moves", row)
                elif code != COMPENSATION_OFF or code in self.control.g:
                    said.append(name)
                continue
            if group == "spindle mode" and code in self.control.g:
                self._say(" ".join([name, *(str(word) for word in row.words if word.letter in "SD")]))
                self.speed = None if row.value("S") is not None else self.speed
                continue
            if code in self.control.g:
                own = codes.WORDS.get(("G", code), "")
                own += "XYZ" if code in LENGTHS else ""
                said.append(" ".join([name, *(str(word) for word in row.words if word.letter in own)]))
                self.inch = code == 200 if group == "units" else self.inch
                self.feed = None if group in ("units", "feed mode") else self.feed
            elif code == 200:
                continue  # lengths are written in mm
            elif name in self.control.idle:
                self._note(name, f"{name} is left out: {self.control.idle[name]}", row)
            else:
                self._refuse(row, name)
        for text in [" ".join(said)] if said and not self.control.one_command else said:
            self._say(text)

    def _say_distance(self, row: Row, name: str) -> None:
        """G90 or G91 where they stand: after G91 E is a step, and Marlin's G90 ends M83."""
        if row.others:
            self._refuse(row, f"{name} beside other codes")
        self._say(name)
        self.absolute = row.absolute

    def _know_diameter(self, row: Row, code: int) -> None:
        """Refuse the radius of a tool that the machine file does not have: its centre would go along the
        contour."""
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
            if code * 10 in ENDS:
                self._end(f"M{code}")
            elif code in (0, 1, 60):
                name = f"M{code}"
                text = self.machine.macros.get(name) or self.control.instead.get(name, name)
                self._option(text, row)
                self._flush_speed()
                self._say(text)

    def _end(self, said: str = "") -> None:
        """The end of the program, which M2 and M30 are where they are known; the spindle does not outlive
        it."""
        self.ended = True
        known = bool(said) and int(said[1:]) in self.control.m
        if self.spindle and not known and said:
            self._say(self.machine.macros.get("M5", "M5"))
        self._say(said if known else self.control.end)
