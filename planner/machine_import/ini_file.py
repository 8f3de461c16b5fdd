"""Settings in tables: `[NAME]`, then `key = value` or `key: value`; LinuxCNC's INI files and Klipper's printer.cfg.

Both are nearly what Python's configparser reads, and differ from it in what counts here: the line of each setting, files that
include others, keys that stand twice (the first counts in LinuxCNC, the last in Klipper), and values that go on in indented lines.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.machine_import.numbers import positive
from planner.machine_import.settings import Sourced

INCLUDES_MAX = 100  # files that one file may include, with those that they include: a circle ends here

_TABLE = re.compile(r"^\[\s*([^\]]+?)\s*\]")
_SETTING = re.compile(r"^([^=:\s][^=:]*?)\s*[=:]\s*(.*)$")


@dataclass(frozen=True)
class IniSetting:
    """The text of one setting and its place."""

    text: str
    source: str
    line: int


class IniFile:
    """Settings by table and key, both in lower case."""

    def __init__(self, source: str):
        self.source = source
        self._settings: dict[tuple[str, str], IniSetting] = {}
        self.names: set[str] = set()

    def add(self, table: str, key: str, setting: IniSetting, *, first_counts: bool) -> None:
        """Take in a setting; one that is there already stays if the first counts."""
        if not (first_counts and (table, key) in self._settings):
            self._settings[table, key] = setting

    def text(self, table: str, key: str) -> str | None:
        """The text of a setting; None where it is not set."""
        found = self._settings.get((table.lower(), key.lower()))
        return found.text if found else None

    def positive(self, table: str, key: str, scale: float = 1.0) -> Sourced | None:
        """A setting's number, times `scale`; None where it is not set. Raises InputError if it is none above 0."""
        found = self._settings.get((table.lower(), key.lower()))
        if found is None or not found.text:
            return None
        place = f"[{table}] {key}"
        return Sourced(positive(found.text, place, found.source, found.line) * scale, place)


def read_ini(
    text: str,
    source: str,
    *,
    first_counts: bool,
    saved_mark: str,
    indented_goes_on: bool,
    included: re.Pattern[str],
) -> IniFile:
    """Read settings, and those of the files that they include, which are looked for beside the file that names them.

    first_counts : whether the first of two equal keys counts, or the last
    saved_mark   : what stands before lines that the control wrote itself, such as "#*#"; "" for none
    indented_goes_on : whether an indented line belongs to the value above it
    included     : of lines that include a file; its first group is a name or a pattern

    Raises InputError for a file that is not there, and for more than `INCLUDES_MAX` files.
    """
    ini = IniFile(source)
    waiting, files = [(text, source)], 0
    while waiting:
        text, source = waiting.pop(0)
        table = key = ""
        for number, raw in enumerate(text.splitlines(), start=1):
            line = raw
            if saved_mark and line.startswith(saved_mark):
                line = line[len(saved_mark) :].lstrip(" ")
            includes = included.match(line)
            if includes:
                found = _files(includes.group(1), source, number)
                files += len(found)
                if files > INCLUDES_MAX:
                    raise InputError(
                        f"more than {INCLUDES_MAX} files are included; is it a circle?",
                        source=source,
                        line=number,
                    )
                waiting += found
                continue
            goes_on = indented_goes_on and key and line[:1] in (" ", "\t")
            line = _without_comment(line).strip()
            if not line or goes_on:
                continue
            header = _TABLE.match(line)
            if header:
                table, key = header.group(1).lower(), ""
                ini.names.add(table)
                continue
            setting = _SETTING.match(line)
            if setting and table:
                key = setting.group(1).lower()
                ini.add(
                    table,
                    key,
                    IniSetting(setting.group(2).strip(), source, number),
                    first_counts=first_counts,
                )
    return ini


def _without_comment(line: str) -> str:
    """A line without its comment: "#" or ";" at its start or after a blank."""
    return re.split(r"(?:^|\s)[#;]", line, maxsplit=1)[0]


def _files(name: str, source: str, line: int) -> list[tuple[str, str]]:
    """Texts and names of the files that a line includes."""
    folder = Path(source).parent
    paths = sorted(folder.glob(name)) if any(c in name for c in "*?[") else [folder / name]
    return [(read_settings(path, f"included in {source}, line {line}: "), str(path)) for path in paths]


def read_settings(path: Path, said: str = "") -> str:
    """The text of a file of settings. Raises InputError if there is none."""
    try:
        require_ending(path)
        return path.read_text(encoding="utf-8", errors="replace")
    except (OSError, ValueError) as fault:
        if isinstance(fault, InputError):
            raise
        reason = fault.strerror if isinstance(fault, OSError) else fault
        raise InputError(f"{said}the file cannot be read: {reason}", source=str(path)) from fault
