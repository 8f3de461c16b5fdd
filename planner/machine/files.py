"""Machine files, and the machines that come with the package."""

from __future__ import annotations

import difflib
import tomllib
from importlib import resources
from pathlib import Path

from planner.base.errors import InputError
from planner.base.files import require_ending
from planner.base.names import known_name
from planner.machine.whole import Machine


def load_machine(path: str | Path) -> Machine:
    """Read a machine file, or a built-in machine if the path is a name without a suffix.

    Raises InputError naming file, key, value and what is allowed, for all faults at once.
    """
    if str(path) in builtin_machines():
        text, source = builtin_text(str(path)), str(path)
    else:
        text, source = _read(Path(path)), str(path)
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise InputError("not a machine file: its values are nested too deep", source=source) from None
    except ValueError as fault:  # a TOMLDecodeError, or a number of more digits than Python reads
        raise InputError(f"not valid TOML: {fault}", source=source) from fault
    return machine_from_dict(data, source=source)


def machine_from_dict(data: dict, *, source: str | None = None) -> Machine:
    """A machine from nested dictionaries with the keys of a machine file. Raises InputError for all faults at once."""
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
    if name not in builtin_machines():
        known_name("built-in machine", name, builtin_machines())
    return (resources.files("planner") / "machines" / f"{name}.toml").read_text(encoding="utf-8")


def _read(path: Path) -> str:
    try:
        require_ending(path)
        return path.read_text(encoding="utf-8")
    except FileNotFoundError as fault:
        names = ", ".join(builtin_machines())
        near = difflib.get_close_matches(str(path), builtin_machines(), n=1)
        hint = f" (did you mean '{near[0]}'?)" if near else ""
        raise InputError(
            f"machine file not found; give a TOML file or one of the built-in machines: {names}{hint}",
            source=str(path),
        ) from fault
    except IsADirectoryError as fault:
        raise InputError("this is a directory; give the machine file", source=str(path)) from fault
    except (OSError, UnicodeDecodeError) as fault:
        raise InputError(f"machine file cannot be read: {fault}", source=str(path)) from fault
