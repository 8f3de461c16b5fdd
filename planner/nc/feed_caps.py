"""Feed caps from a file: what a CAM or load analysis allows on lines of a program, or on lengths of its path.

A table with commas between, and a line of names first:

    line,feed               a line of the program
    file,line,feed          a line of the program or of a file that it calls
    from_mm,to_mm,feed      from and to a length of the programmed path, rapid moves included

Feeds are in the program's units, mm or inches per minute. Where rows overlap the lowest holds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from planner.base.arrays import Array, FloatArray
from planner.base.errors import InputError

LINE, FILE, FROM, TO, FEED = "line", "file", "from_mm", "to_mm", "feed"
TABLES = ((LINE, FEED), (FILE, LINE, FEED), (FROM, TO, FEED))
_ALLOWED = " or ".join(",".join(names) for names in TABLES)
_LINE_MAX = 2**31 - 1  # lines are kept in 32 bits


@dataclass(frozen=True, kw_only=True)
class FeedCaps:
    """The K rows of a file of feed caps."""

    source: str
    text: bytes
    row: Array = field(compare=False, repr=False)  # (K,) their lines in the file, from 1
    # (K,) each by its name: `line`, or `from_mm` and `to_mm` [mm], and `feed` [the program's unit/min]
    columns: dict[str, FloatArray] = field(compare=False, repr=False)
    # (K,) of `file`, "" for the program; or ()
    files: tuple[str, ...] = field(compare=False, repr=False, default=())
    # another name of the program, which it had when it was planned
    main: str = field(compare=False, default="")

    def __str__(self) -> str:
        return self.source

    @property
    def by_length(self) -> FeedCaps | None:
        """What of them holds for a text with other lines: those on lengths of the path."""
        return self if FROM in self.columns else None

    def fault(self, at: int, what: str, name: str = "") -> InputError:
        """An error about row number `at`, from 0, and its value of that name."""
        names, line = list(self.columns), int(self.row[at])
        names[:0] = [FILE] * bool(self.files)
        text = self.text.decode("utf-8-sig", "replace").splitlines()[line - 1]
        fields = text.split(",")[: names.index(name) if name else 0]
        return InputError(what, source=self.source, line=line, column=sum(len(f) + 1 for f in fields) + 1)


def read_feed_caps(path: str | Path) -> FeedCaps:
    """Read a file of feed caps. Raises InputError with line and column of what is no such file."""
    source = str(path)
    try:
        text = Path(path).read_bytes()
    except (OSError, ValueError) as fault:
        why = fault.strerror if isinstance(fault, OSError) else fault
        raise InputError(f"the file of feed caps cannot be read: {why}", source=source) from None
    rows = text.decode("utf-8-sig", "replace").splitlines()
    head = rows[0] if rows else ""
    names = tuple(name.strip().lower() for name in head.split(","))
    if names not in TABLES:
        what = f"the first line is '{head[:60]}'; it names the columns: {_ALLOWED}"
        raise InputError(what, source=source, line=1, column=1)
    given = [(n, *_values(row, names, source, n)) for n, row in enumerate(rows[1:], start=2) if row.strip()]
    if not given:
        raise InputError("there is no row below the names of the columns", source=source, line=1, column=1)
    lines, files, numbers = zip(*given, strict=True)
    columns = dict(zip(names[-len(numbers[0]) :], np.array(numbers).T, strict=True))
    files = files if names[0] == FILE else ()
    return FeedCaps(source=source, text=text, row=np.array(lines), columns=columns, files=files)


def _values(row: str, names: tuple[str, ...], source: str, line: int) -> tuple[str, list[float]]:
    """The file of a row, "" without one, and its numbers. Raises InputError."""
    fields = row.split(",")
    if len(fields) != len(names):
        what = f"{len(fields)} values; {len(names)} are allowed: {','.join(names)}, decimals with a point"
        raise InputError(what, source=source, line=line, column=1)
    file, column = "", 1
    values: list[float] = []
    for name, text in zip(names, fields, strict=True):
        word = text.strip().strip('"')
        try:
            value = float(word) if name != FILE else math.nan
        except ValueError:
            value = math.nan
        least = values[-1] if name == TO else 0.0
        if name == FILE:  # what is wrong is written out only then: files have a row for each block
            wrong = "" if word else "the name of the program or of a file that it calls"
        elif name == LINE:
            wrong = "" if value % 1.0 == 0.0 and 1.0 <= value <= _LINE_MAX else "a line number, 1 or more"
        elif name == FROM:
            wrong = "" if least <= value < math.inf else "a length in mm, 0 or more"
        else:
            unit = "length in mm" if name == TO else "feed in the program's mm/min or inch/min"
            wrong = "" if least < value < math.inf else f"a {unit}, above {least:g}"
        if wrong:
            what = f"{name} is '{word[:40]}'; it must be {wrong}"
            raise InputError(what, source=source, line=line, column=column)
        if name == FILE:
            file = word
        else:
            values.append(value)
        column += len(text) + 1
    return file, values
