"""Machine files, and the machines that come with the package."""

import difflib
import re
import tomllib
from importlib import resources
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.base.names import known_name
from planner.machine.whole import Machine

_DECIMAL = re.compile(r"^[^#\"'\[]*=\s*(\d+),(\d+)\s*(?:#.*)?$", re.MULTILINE)  # 0,001
# Of settings of a control: sections of LinuxCNC and Klipper, numbers of grbl, commands of Marlin.
_SETTINGS = re.compile(
    r"^\s*(\[(EMC\w*|TRAJ|AXIS_\w|printer)\]|\$\d+\s*=|(echo:)?\s*M20[13]\s+X)", re.MULTILINE
)

# Of programs. Machine files may have a key M6 or x.velocity, Klipper's settings macros, but these have tables or names too.
_PROGRAM = re.compile(r"^\s*/?(N\d+\s*)?([GMT]\d|[XYZ][-+.\d])", re.MULTILINE | re.IGNORECASE)
_TABLE = re.compile(r"^\s*(\[|[a-z_.]{2,}\s*=)", re.MULTILINE)
SIZE_MAX = 1_000_000  # bytes of a machine file: ten thousand tools
# A key of more parts than there are tables in tables.
_DEEP = re.compile(r"^[^=\n#]*(?:\.[^=\n#.]*){50}", re.MULTILINE)


def load_machine(path: str | Path) -> Machine:
    """Read a machine file, or a built-in machine if the path is a name without a suffix.

    Raises InputError naming file, key, value and what is allowed, for all faults at once.
    """
    if not isinstance(path, (str, Path)):
        what = "a file, the name of a built-in one, or planner.Machine(...)"
        raise InputError(f"a machine is {what}; found a {type(path).__name__}")
    source = str(path)
    text = builtin_text(source) if source in builtin_machines() else _read(Path(path))
    deep = "not a machine file: its values are nested too deep"
    if _DEEP.search(text):  # Python's reader takes the square of the depth
        raise InputError(deep, source=source)
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise InputError(deep, source=source) from None
    except ValueError as fault:
        is_toml, of_control = isinstance(fault, tomllib.TOMLDecodeError), _SETTINGS.search(text) is not None
        settings = "; a machine file is made of a control's settings by: planner machine import" * of_control
        reason = fault if is_toml else "a number has more than 4,300 digits"
        if _PROGRAM.search(text) and not of_control and not _TABLE.search(text):
            said = f"an NC program, where a machine file is needed: a TOML file, or one of {', '.join(builtin_machines())}"
            raise InputError(said, source=source) from None
        decimal = _DECIMAL.search(text)
        comma = f"; decimals have a point: {decimal[1]}.{decimal[2]}" if decimal else ""
        raise InputError(f"not valid TOML: {reason}{comma}{settings}", source=source) from fault
    return machine_from_dict(data, source=source)


def machine_from_dict(data: dict[str, Any], *, source: str | None = None) -> Machine:
    """A machine from dictionaries with the keys of its file. Raises InputError for all faults at once."""
    try:
        return Machine(**data)
    except InputError as fault:
        raise InputError(fault.message, source=source) from None
    except TypeError as fault:
        raise InputError(str(fault), source=source) from fault


def builtin_machines() -> tuple[str, ...]:
    """Names of the machines that come with the package."""
    folder = resources.files("planner") / "machines"
    return tuple(sorted(f.name[:-5] for f in folder.iterdir() if f.name.endswith(".toml")))


def builtin_text(name: str) -> str:
    """The commented TOML of a built-in machine. Raises InputError for an unknown name."""
    known_name("built-in machine", name, builtin_machines())
    return (resources.files("planner") / "machines" / f"{name}.toml").read_text(encoding="utf-8")


def _read(path: Path) -> str:
    try:
        require_ending(path)
        with path.open("rb") as file:
            data = file.read(SIZE_MAX + 1)
        if len(data) > SIZE_MAX:
            raise InputError(f"not a machine file: it has more than {SIZE_MAX:,} bytes", source=str(path))
        text = data.decode("utf-8-sig")  # editors of Windows put a mark in front
        return text.replace("\r\n", "\n").replace("\r", "\n")
    except FileNotFoundError as fault:
        names = ", ".join(builtin_machines())
        there = [str(file) for file in path.parent.glob("*.toml")] if path.parent.is_dir() else []
        near = difflib.get_close_matches(str(path), [*builtin_machines(), *there], n=1)
        hint = f" (did you mean '{near[0]}'?)" if near else ""
        raise InputError(
            f"machine file not found; give a TOML file or one of the built-in machines: {names}{hint}; make one with: planner "
            "machine init FILE, or from a control's settings: planner machine import",
            source=str(path),
        ) from fault
    except IsADirectoryError as fault:
        raise InputError("this is a directory; give the machine file", source=str(path)) from fault
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(f"machine file cannot be read: {fault}", source=str(path)) from fault
