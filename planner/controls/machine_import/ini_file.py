"""Settings in tables, `[NAME]`, then `key = value` or `key: value`: LinuxCNC's INI files and Klipper's
printer.cfg.

Both take a file that is included at the place where it is named. For the rest they differ in what counts, and
each is read as its control reads it (LinuxCNC 2.9: src/libnml/inifile/inifile.cc and scripts/linuxcnc;
Klipper: klippy/configfile.py):

    LinuxCNC   the first table of a name and in it the first of equal keys; upper and lower case differ; a comment is
               a line of its own; a backslash at its end goes on with the next line; a missing file is left
               out
    Klipper    the last of equal keys, whichever table of that name it is in; `key = ` begins at a line's start, and an
               indented line belongs to the value above it; "#" begins a comment anywhere, ";" after a blank;
               a missing file is an error. What SAVE_CONFIG wrote ("#*#" at the end of the first file) counts
               where the rest says nothing
"""

import codecs
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.controls.machine_import.settings import Setting, Settings

INCLUDES_MAX = 100  # files that one file may include, with those that they include

_LINUXCNC_INCLUDE = re.compile(r"^\s*#INCLUDE(?:\s+(.*?))?\s*$")
_KLIPPER_INCLUDE = re.compile(r"^\[include (.+)\]")
_TABLE = re.compile(r"^\[(.+)\]")
_SETTING = re.compile(r"^([^=:]+?)\s*[=:]\s*(.*)$")
# Tables of LinuxCNC that are read.
_READ = re.compile(r"(?:TRAJ|KINS|HAL|EMCMOT|DISPLAY|RS274NGC|AXIS_\w|JOINT_\d+)$")
_SAVED = re.compile(
    r"\n#\*# <-+ SAVE_CONFIG -+>\n#\*# DO NOT EDIT THIS BLOCK OR BELOW\. The contents are auto-generated\.\n#\*#\n"
)
_SAVED_LINE = "#*#"


class _Line(NamedTuple):
    """A line of a file."""

    text: str
    source: str
    number: int
    after_include: bool = False  # a file was included before it


def read_linuxcnc_ini(text: str, source: str) -> Settings:
    """An INI file, as LinuxCNC reads it. Raises InputError for files that include each other."""
    ini = Settings(begins=True)
    table: str | None = None
    pending = ""
    for line in _expanded(text, source, _LINUXCNC_INCLUDE, ini.notes):
        whole = pending + line.text.rstrip("\r")
        if whole.endswith("\\"):
            pending = whole[:-1]
            continue
        pending, found = "", whole.strip()
        header = _TABLE.match(found)
        if header:
            name = header.group(1)
            if name in ini.names and _READ.match(name):
                ini.notes.append(f"the second [{name}] is left out, as in LinuxCNC: the first counts")
            table = None if name in ini.names else name
            ini.names.append(name)
        elif table is not None and found[:1] not in ("", "#", ";", "[") and "=" in found:
            key, _, value = found.partition("=")
            ini.add(table, key.strip(), Setting(value.strip(), line.source, line.number))
    return ini


def read_klipper_config(text: str, source: str) -> Settings:
    """The settings of a printer.cfg, as Klipper reads it. Raises InputError for a setting outside of a table,
    for files that include each other and for those that are not there."""
    text = text.replace("\r\n", "\n")
    mark = _SAVED.search(text)
    own, saved = (text[: mark.start()], text[mark.end() :].strip()) if mark else (text, "")
    lines = saved.split("\n") if saved else []
    wrong = any(not line.startswith(_SAVED_LINE) or line[3:4] not in ("", " ") for line in lines)
    if wrong or f"\n{_SAVED_LINE} " in own:  # changed by hand: Klipper leaves it out
        own, lines = text, []
    config = _klipper_tables(own, source)
    if lines:
        config.take_missing(_klipper_tables("\n".join(line[4:] for line in lines), source))
    elif f"\n{_SAVED_LINE} [" in text:
        config.notes.append("the block of SAVE_CONFIG was changed by hand and is left out, as Klipper does")
    return config


def _klipper_tables(text: str, source: str) -> Settings:
    """The settings of a text, the last of equal ones."""
    config = Settings()
    table = key = ""
    indent = 0
    for line in _expanded(text, source, _KLIPPER_INCLUDE, None):
        if line.after_include:
            table = key = ""
        bare = re.split(r"(?:^|\s);", line.text.partition("#")[0], maxsplit=1)[0].rstrip()
        found = bare.strip()
        depth = len(bare) - len(bare.lstrip())
        if not found or (key and depth > indent):
            if found and table.startswith("gcode_macro"):
                config.go_on(table, key, found)
            continue
        header, setting = _TABLE.match(found), _SETTING.match(found)
        if header:
            table, key = header.group(1), ""
            config.names.append(table)
        elif not table:
            said = f"'{found[:40]}' is in no table: Klipper begins anew after an [include ...]; write its table above it again"
            raise InputError(said, source=line.source, line=line.number)
        elif setting:
            key, indent = setting.group(1).lower(), depth
            config.add(table, key, Setting(setting.group(2), line.source, line.number))
    config.counts_last()
    return config


def _expanded(
    text: str,
    source: str,
    include: re.Pattern[str],
    left_out: list[str] | None,
    included: list[str] | None = None,
) -> Iterator[_Line]:
    """The lines of a text, with those of the files that it includes in their places.

    include  : of lines that include a file; its first group is a name or, for Klipper, a pattern
    left_out : takes a note on every file that is not there; None to refuse them
    included : the files so far
    """
    included, after = [] if included is None else included, False
    for number, line in enumerate(text.split("\n"), start=1):
        found = include.match(line)
        if not found:
            yield _Line(line, source, number, after)
            after = False
            continue
        after, name = True, found.group(1) or ""
        for path in _files(name, source):
            included.append(str(path))
            if len(included) > INCLUDES_MAX:
                said = f"more than {INCLUDES_MAX} files are included; is it a circle?"
                raise InputError(said, source=source, line=number)
            try:
                part = read_settings(path, f"included in {source}, line {number}: ")
            except InputError:
                if left_out is None:
                    raise
                said = f"line {number}: the file '{name}' cannot be read and is left out, as in LinuxCNC"
                left_out.append(said)
                continue
            yield from _expanded(part, str(path), include, left_out, included)


def _files(name: str, source: str) -> list[Path]:
    """The files that a line includes, looked for beside the file that names them."""
    folder, path = Path(source).parent, Path(name.strip()).expanduser()
    if not any(c in name for c in "*?["):
        return [folder / path]
    if path.is_absolute():
        folder, path = Path(path.anchor), path.relative_to(path.anchor)
    return sorted(folder.glob(str(path)))


def read_settings(path: Path, said: str = "") -> str:
    """The text of a file of settings, UTF-16 too, as Windows' shell saves what a control prints. Raises InputError if
    there is none."""
    try:
        require_ending(path)
        data = path.read_bytes()
        is_utf16 = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = data.decode("utf-16" if is_utf16 else "utf-8-sig", "replace")
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except (OSError, ValueError) as fault:
        if isinstance(fault, InputError):
            raise
        reason = fault.strerror if isinstance(fault, OSError) else fault
        raise InputError(f"{said}the file cannot be read: {reason}", source=str(path)) from fault
