"""Folders whose files may be run: nobody else can put something there.

Compiled kernels are machine code. A folder that they come from is named by an absolute path, or it would be one of the folder that a
program was downloaded to; it and its parents belong to this user, to root, or to the owner of this package, whose code runs already;
and no others can write them, unless the owner alone can take away what is in them (the sticky bit of /tmp). Symbolic links are
followed, and what they lie in is looked at as well. Windows has other means than owners and modes, and gives everybody a folder of
their own: there the path alone is looked at.
"""

from __future__ import annotations

import os
import stat
from functools import cache
from pathlib import Path


def fault_of(folder: str) -> str:
    """Why files of this folder must not be run, in words after its name; empty if they may. It need not be there yet."""
    if not os.path.isabs(folder):
        return "is not an absolute path"
    if not hasattr(os, "geteuid"):
        return ""
    for start in {folder, os.path.realpath(folder)}:
        for path in (start, *map(str, Path(start).parents)):
            try:
                said = fault_of_file(os.stat(path), sticky=path != start)
            except FileNotFoundError:  # to be made, by this user
                continue
            except OSError as fault:
                said = f"cannot be looked at ({fault.strerror})"
            if said:
                return said if path == folder else f"is in {path}, which {said}"
    return ""


def fault_of_file(found: os.stat_result, *, sticky: bool = False) -> str:
    """Why what this was said of may be somebody else's, in words after its name; empty if it is not.

    sticky : whether others may write a folder in which they can take away nothing that is not theirs
    """
    if not hasattr(os, "geteuid"):
        return ""
    if found.st_uid not in {0, os.geteuid(), _owner_of_package()}:
        return f"belongs to user {found.st_uid}"
    if sticky and found.st_mode & stat.S_ISVTX:
        return ""
    if found.st_mode & stat.S_IWOTH:
        return "can be written by all users"
    if found.st_mode & stat.S_IWGRP and found.st_gid != 0 and found.st_gid != _private_group():
        return f"can be written by group {found.st_gid}"
    return ""


@cache
def _owner_of_package() -> int:
    return os.stat(__file__).st_uid


@cache
def _private_group() -> int | None:
    """The group that is this user's alone, as many systems give everybody one of their own name; None without one."""
    import grp
    import pwd

    try:
        user = pwd.getpwuid(os.geteuid())
        group = grp.getgrgid(user.pw_gid)
    except KeyError:
        return None
    return user.pw_gid if group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name} else None
