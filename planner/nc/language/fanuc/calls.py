"""Fanuc's and Haas' macros: their expressions, and calls and returns (M97, M98, M99, G65, G66)."""

from collections import Counter
from collections.abc import Sequence

from planner.nc.language import tree
from planner.nc.language.expressions import ARITHMETIC, COMPARISONS
from planner.nc.language.source import SourceLine
from planner.nc.language.system_variables import FanucVariables
from planner.nc.language.tokens import names, ranked
from planner.nc.language.tree import Language

LOCALS = 33  # #1 to #33 are a call's own
LANGUAGE = Language(
    operations=ARITHMETIC
    | {
        ("AND", 2): "float(int({0})&int({1}))",
        ("OR", 2): "float(int({0})|int({1}))",
        ("XOR", 2): "float(int({0})^int({1}))",
        ("ATAN", 2): "(atan2({0},{1})%360.0)",
        ("FIX", 1): "float(trunc({0}))",
        ("FUP", 1): "copysign(ceil(abs({0})),{0})",
        ("ROUND", 1): "copysign(floor(abs({0})+0.5),{0})",
    },
    ranks=ranked("EQ NE GT GE LT LE", "+ - OR XOR", "* / MOD AND"),
    functions=names("ABS ACOS ADP ASIN ATAN BCD BIN COS EXP FIX FUP LN ROUND SIN SQR SQRT TAN"),
    keywords=names("IF THEN WHILE GOTO DO END POPEN PCLOS DPRNT BPRNT SETVN"),
    long_values=True,
    behind_commas=frozenset("ACR"),
    conditions=COMPARISONS,
    locals=LOCALS,
    largest=19_999,
    vacant=None,
    system_numbers=FanucVariables.numbers,
    read="({0} or 0.0)",
    raw=frozenset(("EQ", "NE")),
)
_NUMBERS = {  # parameters of the letters of G65
    **dict(zip("ABCIJK", range(1, 7), strict=True)),
    **{"D": 7, "E": 8, "F": 9, "H": 11, "M": 13, "Q": 17, "R": 18, "S": 19, "T": 20},
    **dict(zip("UVWXYZ", range(21, 27), strict=True)),
}
_TRIPLES = "IJK"  # given several times, they are #4 #5 #6, #7 #8 #9 ...
_LONGEST_NUMBER = 4  # digits of a program's number; those before them in M98 P are repetitions


def subprogram(words: tree.Words, line: SourceLine, known: frozenset[str]) -> list[tree.Statement]:
    """M98. known : the numbers of the file's programs. Raises ProgramFault."""
    rest, given = _split(words, "M98", "PL", line)
    line.require("P" in given, "M98 needs P with the number of a subprogram")
    name: str | tree.Expression = given["P"]
    times: tree.Expression = given.get("L", tree.ONE)
    if isinstance(name, tree.Number):
        number = f"{name.value:.0f}"
        if number not in known and len(number) > _LONGEST_NUMBER and "L" not in given:
            times = tree.Number(float(number[:-_LONGEST_NUMBER]))
            number = number[-_LONGEST_NUMBER:]
        name = str(int(number))
    return [*rest, tree.Call(line.place, name, None, _called("M98", name), times)]


def of_block(
    words: tree.Words, line: SourceLine, program: tree.Procedure
) -> tuple[int, list[tree.Statement]]:
    """M97: the block that is called, and the statements. Raises ProgramFault."""
    rest, given = _split(words, "M97", "PL", line)
    called, times = given.get("P"), given.get("L", tree.ONE)
    if not isinstance(called, tree.Number):
        raise line.fault("M97 needs P with the number of a block")
    number = int(called.value)
    call = tree.Call(line.place, block_name(number, program), None, f"M97 P{number}", times)
    return number, [*rest, call]


def returned(
    words: tree.Words, line: SourceLine, before: Sequence[tree.Statement], *, restarts: bool
) -> list[tree.Statement]:
    """M99. restarts : it stands in the main program, whose statements so far are `before`: a control starts it
    again, or goes to the block P."""
    statements, given = _split(words, "M99", "P", line)
    to = given.get("P")
    back = [tree.Number(float(one.number)) for one in before if isinstance(one, tree.Label)]
    if restarts and to is not None and to not in back:
        return [*statements, tree.Goto(line.place, to)]
    if restarts:
        statements.append(tree.Message(line.place, ("M99 starts the main program again; it is read once",)))
    return [*statements, tree.Return(line.place, None, to)]


def macro(words: tree.Words, code: str, line: SourceLine) -> tree.Call:
    """G65, or the call that G66 makes after every move. Raises ProgramFault."""
    arguments: dict[int, tree.Expression] = {}
    seen: Counter[str] = Counter()
    program: str | tree.Expression = ""
    times: tree.Expression = tree.ONE
    for word in words:
        letter = word.letter
        if word.code == code or letter == "N":
            continue
        if letter == "P":
            program = f"{word.value.value:.0f}" if isinstance(word.value, tree.Number) else word.value
        elif letter == "L":
            times = word.value
        elif letter in _NUMBERS:
            arguments[_NUMBERS[letter] + 3 * seen[letter]] = word.value
            seen[letter] += letter in _TRIPLES
        else:
            raise line.fault(f"{code} has no parameter for {letter}", word.at)
    if program == "" or max(arguments, default=0) > LOCALS:
        raise line.fault(f"{code} needs P with the number of a macro, and at most ten of I, J and K")
    return tree.Call(line.place, program, tuple(arguments.items()), _called(code, program), times)


def fanuc_files(name: str) -> frozenset[str]:
    """Names that the file of program O1000 may have, in small letters."""
    numbers = {name, name.zfill(_LONGEST_NUMBER)}
    stems = {f"{letter}{number}" for number in numbers for letter in ("", "o")}
    return frozenset(stem + ending for stem in stems for ending in ("", ".nc", ".ngc", ".cnc", ".tap"))


def block_name(number: int, program: tree.Procedure) -> str:
    """The name of what M97 calls: the program from its block of that number on."""
    return f"N{number} of O{program.name}" if program.name else f"N{number}"


def _split(
    words: tree.Words, code: str, letters: str, line: SourceLine
) -> tuple[list[tree.Statement], dict[str, tree.Expression]]:
    """The row of the words that a call does not use, if there are any, and those that it does."""
    rest, given = [], dict[str, tree.Expression]()
    for word in words:
        if word.letter in letters and word.letter not in given:
            given[word.letter] = word.value
        elif word.code != code:
            rest.append(word)
    return [tree.Line(line.place, tuple(rest))] if rest else [], given


def _called(code: str, name: str | tree.Expression) -> str:
    return f"{code} P{name}" if isinstance(name, str) else f"{code} P"
