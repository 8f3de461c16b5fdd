"""The running program: its parameters, its calls, its limits, and the errors of its arithmetic as sentences.

Rows go to the interpreter in chunks. A parameter that holds the state of the control (a position, an offset,
the tool) is asked of the interpreter after everything pending has been executed.

A program may run for ever. It is stopped after `TURNS_MAX` turns of loops, jumps and calls, `ROWS_MAX` rows
(`BY_WORD_MAX` that are no plain straight moves), `IDLE_MAX` rows without a move, or at `DEPTH_MAX` open
calls, with a sentence that names the line.
"""

import contextlib
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from planner.base.sizes import SIZES
from planner.nc.interpreter import Interpreter
from planner.nc.language.compiled import (
    Functions,
    Places,
    endless,
    last_statement,
    sentence,
    statement_of,
    whole,
)
from planner.nc.language.making import Maker, Making
from planner.nc.language.rows import AppendedRows, TravelRow
from planner.nc.language.source import Source
from planner.nc.language.system_variables import Modes, SystemVariables
from planner.nc.language.travel import Travel
from planner.nc.language.tree import Language, ProgramFault, SourcePlace
from planner.nc.lexer import Words
from planner.nc.program import Frame

TURNS_MAX = 50_000_000  # turns of loops, jumps and calls: some ten seconds of computing
IDLE_MAX = 20_000  # rows one after the other that neither move nor stop: a loop that only switches something never ends
ROWS_MAX = 5_000_000  # rows of words: 50 bytes each in the program that is made of them
DEPTH_MAX = 100  # open calls; LinuxCNC allows 10
BY_WORD_MAX = 500_000  # rows that are no plain straight moves: they take 0.1 ms each, a minute in all
ROWS_AT_ONCE = SIZES.program_rows
IDLE_AT_ONCE = SIZES.idle_rows
FRAMES_MAX = 1_000_000  # different chains of calls
_MESSAGES_MAX = 1_000  # different messages that are kept
Load = Callable[[str], bool]


@dataclass(frozen=True)
class Dialect:
    """All that is known of a dialect: the table that a new one fills.

    language  : its operators, functions and parameters
    variables : its parameters that hold the state of the control
    parser    : of a file: `parse` gives procedures, `faults` are those of its lines
    files     : names, in small letters, of the file that holds a subprogram
    unknown   : what is said of a subprogram, {0}, that is not there
    """

    language: Language
    variables: type[SystemVariables]
    parser: Callable[[Source], Any]
    files: Callable[[str], frozenset[str]]
    unknown: str = "there is no such subprogram in this program or its folder"


class Ended(Exception):
    """The program has come to its end."""


class ProgramRun:
    """One run of a compiled program."""

    def __init__(self, interpreter: Interpreter, rows: AppendedRows, dialect: Dialect):
        self.interpreter, self.rows, self.language = interpreter, rows, dialect.language
        self.system = dialect.variables(interpreter)
        # values of the numbered parameters, by number
        self.numbered: list[float | None] = [self.language.vacant] * (self.language.largest + 1)
        self.shared: dict[str, float] = {}  # values of the named parameters that all calls share
        self.turns = 0
        self.resume: float | None = None  # the label where the caller of a procedure goes on, or None
        self.units: dict[str, Places] = {}  # compiled files, by the marker of their source
        self.functions: Functions = {}
        self.frames = [Frame(name="", source=interpreter.source, line=0, caller=-1)]
        self.files = [interpreter.source]
        self.load: Load = lambda name: False
        self.tee: Callable[[Words], None] = lambda words: None
        self.calls: Counter[str] = Counter()  # by name
        self.executed = 0  # rows
        self.idle = 0  # of them, since the last block
        self._frame = 0
        self._depth = 0
        self._known_frames: dict[tuple[int, int, int, str], int] = {}
        # of each open call: the modes that it has saved, and whether they are restored at its end
        self._saved: list[tuple[Modes | None, bool]] = [(None, False)]
        self._messages = 0
        self._at_once = IDLE_AT_ONCE
        self.travel = Travel(interpreter, rows)
        self.system.travel = self.travel
        self._unknown = dialect.unknown

    def start(self, main: str = "") -> ProgramFault | None:
        """Run the main program to its end; returns what stopped it before."""
        stopped = self._run(main)
        left = self.interpreter.take_back()
        if stopped is None and left is not None:
            text = "the program ends inside the profile of this cycle; end it behind the cycles"
            return ProgramFault(SourcePlace(*left), text)
        return stopped

    def _run(self, main: str) -> ProgramFault | None:
        try:
            self.functions[main](self, {})
            self.flush()
            try:
                left = self.travel.end()
            except ValueError as fault:  # what a statement began has no end: no statement of its own to name
                return self._stopped(ProgramFault(last_statement(self.units), str(fault)))
            if left:
                self._execute(self.rows.words_of(left))
        except Ended:
            return None
        except ProgramFault as fault:
            return self._stopped(fault)
        except (ArithmeticError, ValueError, KeyError) as fault:
            return self._stopped(ProgramFault(statement_of(fault.__traceback__, self.units), sentence(fault)))
        return None

    def flush(self) -> None:
        """Execute what is pending. Raises Ended if the program has ended with it."""
        if self.rows.pending:
            self._pass_on(self.rows.take())
        if self.interpreter.ended:
            raise Ended

    def _pass_on(self, words: Words) -> None:
        for rows in self.travel.through(words):
            self._execute(rows)

    def _execute(self, words: Words) -> None:
        self.executed += len(words.line)
        words = self.interpreter.in_seconds(words)
        if self.interpreter.aside is None:
            self.tee(words)
        self.interpreter.execute(words)

    def tick(self) -> None:
        """Execute what is pending once that is long. Raises ValueError if the program has passed a limit."""
        if self.turns > TURNS_MAX:
            raise endless(f"{TURNS_MAX:,} turns of loops, jumps and calls")
        pending = len(self.rows.pending)
        if pending > self._at_once:
            blocks = self.interpreter.table.blocks + self.travel.moves
            self.flush()
            moved = self.interpreter.table.blocks + self.travel.moves > blocks
            self.idle = 0 if moved else self.idle + pending
            self._at_once = min(2 * self._at_once, ROWS_AT_ONCE) if moved else IDLE_AT_ONCE
            if self.idle > IDLE_MAX:
                raise endless(f"{self.idle:,} lines executed without a move")
            if self.interpreter.by_word > BY_WORD_MAX:
                raise endless(f"{BY_WORD_MAX:,} lines that are no plain straight moves")
        if self.executed + pending > ROWS_MAX:
            raise endless(f"{ROWS_MAX:,} lines executed")

    def call(
        self,
        place: tuple[int, int, int],
        word: str,
        name: str | int,
        arguments: tuple[tuple[int, float | None], ...] | None,
        times: float,
    ) -> None:
        """Run a procedure; its value, if it has one, is `_value` afterwards."""
        function = self._function(str(name), word)
        if self._depth >= DEPTH_MAX:
            raise ValueError(f"{DEPTH_MAX} calls are open; a subprogram that calls itself must end some time")
        count, numbered, locals_ = whole(times), self.numbered, self.language.locals
        caller, self._frame = self._frame, self._frame_of(place, str(name))
        self._depth += 1
        self._saved.append((None, False))
        self.rows.enter(self._frame)
        value = None
        for _ in range(count):
            self.turns += 1
            self.calls[str(name)] += 1
            if not self.turns & 127 or len(self.rows.pending) > self._at_once:
                self.tick()
            if arguments is None:
                value = function(self, {})
            else:
                outer = numbered[1 : locals_ + 1]
                numbered[1 : locals_ + 1] = [self.language.vacant] * locals_
                for number, given in arguments:
                    numbered[number] = given
                value = function(self, {})
                numbered[1 : locals_ + 1] = outer
            if self._saved[-1][1]:
                self.modes("restore", place)
        self._saved.pop()
        self._depth -= 1
        self._frame = caller
        self.rows.enter(caller)
        self.shared["_value"] = 0.0 if value is None else value
        self.shared["_value_returned"] = 0.0 if value is None else 1.0

    def get(self, index: float) -> float | None:
        """The value of a parameter whose number is computed."""
        number = self._number(index)
        return self.ask(number) if number in self.language.system_numbers else self.numbered[number]

    def put(self, index: float, value: float | None) -> None:
        """Give a value to a parameter whose number is computed, or that belongs to the control."""
        number = self._number(index)
        if number in self.language.system_numbers:
            self.flush()
            self.system.put(number, value)
        elif number == 0:
            raise ValueError("parameter #0 cannot be given a value")
        else:
            self.numbered[number] = value

    def exists(self, index: float) -> bool:
        """True if there is a parameter of that number, with a value."""
        number = round(index)
        return 0 < number <= self.language.largest and (
            number in self.language.system_numbers or self.numbered[number] is not None
        )

    def ask(self, parameter: int | str) -> float:
        """A parameter that holds the state of the control, after everything before it."""
        self.flush()
        return self.system.get(parameter, self._depth)

    def message(self, line: int, pieces: tuple[object, ...]) -> None:
        """Keep a text for the user."""
        self._messages += 1
        if self._messages > _MESSAGES_MAX:
            return
        texts = (p if isinstance(p, str) else "######" if p is None else f"{p:.6f}" for p in pieces)
        self.interpreter.findings.note(f"message: {''.join(texts).strip()}", line)

    def modes(self, action: str, place: tuple[int, int, int]) -> None:
        """Save the modal state, forget it, or write the words that restore it."""
        self.flush()
        saved, at_end = self._saved[-1]
        if action == "forget":
            self._saved[-1] = None, at_end
        elif action in ("save", "save until return"):
            self._saved[-1] = self.system.modes(), at_end or action == "save until return"
        elif saved is not None:
            rows = ([(ord(letter), value, place[2]) for letter, value in row] for row in saved)
            self._execute_made([TravelRow(words, place[1], self._frame) for words in rows])
        elif not at_end:
            raise ValueError("M72 restores the modes that M70 saved in the same call; there are none")

    def made(self, maker: Maker, given: tuple[tuple[str, float], ...], place: tuple[int, int, int]) -> None:
        """Execute the rows that a maker makes of values; each row a list of letters and numbers."""
        self.flush()
        state = self.interpreter, self.travel, self.shared, self.numbered
        making = Making(*state, SourcePlace(*place), self._frame, self._execute_made)
        making.take(maker(making, dict(given)))
        self.tick()
        self.flush()

    def _execute_made(self, rows: list[TravelRow]) -> None:
        self._pass_on(self.rows.words_of(rows))
        self.tick()

    def label(self, blocks: dict[int, int], number: float) -> int:
        """Where a computed jump leads."""
        if whole(number) not in blocks:
            raise ValueError(f"there is no block N{number:g} to go to; write its number at its start")
        return blocks[whole(number)]

    def resumed(self) -> float:
        """The label where the caller goes on, which is used up."""
        label, self.resume = self.resume, None
        assert label is not None
        return label

    def _number(self, index: float) -> int:
        number = whole(index)
        if not 0 <= number <= self.language.largest or (number == 0 and self.language.vacant is not None):
            low = 1 if self.language.vacant is not None else 0
            raise ValueError(f"parameter #{number} is not one of #{low} to #{self.language.largest}")
        return number

    def _function(self, name: str, word: str) -> Callable[..., float | None]:
        if name not in self.functions and (not self.load(name) or name not in self.functions):
            raise ValueError(f"{word}: {self._unknown.format(word)}")
        return self.functions[name]

    def _frame_of(self, place: tuple[int, int, int], name: str) -> int:
        key = (self._frame, place[0], place[1], name)
        known = self._known_frames.get(key)
        if known is None:
            if len(self.frames) >= FRAMES_MAX:
                raise endless(f"{FRAMES_MAX:,} different chains of calls")
            known = self._known_frames[key] = len(self.frames)
            file = self.units[self.functions[name].__code__.co_filename][0].file
            self.frames.append(Frame(name=name, source=self.files[file], line=place[1], caller=self._frame))
        return known

    def _stopped(self, fault: ProgramFault) -> ProgramFault:
        """Execute what is pending; the message gets the calls that led to the place."""
        message, frame = fault.message, self._frame
        while frame > 0:
            message += f"; called from line {self.frames[frame].line}"
            if message.count("; called") == 3:
                message += " ..."
                break
            frame = self.frames[frame].caller
        with contextlib.suppress(Ended, ProgramFault):
            self.flush()
        return ProgramFault(fault.place, message)
