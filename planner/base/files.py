"""Reading input files that end, unlike devices and named pipes; and file names in texts."""

import os
import stat
import sys
from pathlib import Path

from planner.base.errors import InputError

STREAMS = ("/dev/stdin", "/dev/fd/", "/proc/self/fd/")  # where a shell's pipes and process substitutions are

STDIN = "-"  # as a file name: the standard input


def readable(text: str) -> str:
    """A text that can be written as UTF-8. Bytes of a file name that Python could not decode, as in names
    from other systems, become the characters that they are in UTF-8, or such as \\xfc."""
    if text.isascii():
        return text
    try:
        data = text.encode("utf-8", "surrogateescape")
    except UnicodeEncodeError:  # half of a pair of UTF-16, which JSON may hold
        data = text.encode("utf-8", "backslashreplace")
    return data.decode("utf-8", "backslashreplace")


def require_ending(path: str | Path) -> None:
    """Raise InputError if `path` is a device, a socket or a pipe but a shell's; OSError without a file."""
    mode = os.stat(path).st_mode
    if stat.S_ISREG(mode) or stat.S_ISDIR(mode) or (stat.S_ISFIFO(mode) and str(path).startswith(STREAMS)):
        return
    what = "a named pipe" if stat.S_ISFIFO(mode) else "a device or a socket"
    said = f"this is {what}; give a regular file, or the output of a program by | and /dev/stdin"
    raise InputError(said, source=str(path))


def standard_input() -> bytes:
    """The bytes on the standard input, to its end. Raises OSError if there is none, or it cannot be read."""
    if sys.stdin is None:  # closed by the caller: <&-
        raise OSError("the standard input is closed")
    return sys.stdin.buffer.read()
