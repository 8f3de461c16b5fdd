"""Does a failure come of too little memory? Libraries say so in many ways, and some only that they cannot be loaded.

Under a limit of the address space (`ulimit -v`, batch systems) the first that does not fit is often a shared library: the loader then
reports a segment that cannot be mapped, and llvmlite only a library that cannot be found.
"""

from __future__ import annotations

import errno
import mmap

# What loaders, threads and C++ say, in lower case.
_SAID = (
    "failed to map segment",
    "cannot allocate memory",
    "bad_alloc",
    "can't start new thread",
    "out of memory",
)
_LIBRARY = 256 << 20  # bytes: more than the largest library that planning loads (libllvmlite, 130 MB)


def is_of_memory(fault: BaseException) -> bool:
    """Whether an exception, or one that it came of, is of too little memory."""
    seen: list[BaseException] = []
    one: BaseException | None = fault
    while one is not None and one not in seen:
        seen.append(one)
        if isinstance(one, MemoryError) or (isinstance(one, OSError) and one.errno == errno.ENOMEM):
            return True
        if any(words in str(one).lower() for words in _SAID):
            return True
        one = one.__cause__ or one.__context__
    # Python's own modules end in a SystemError where an allocation in them has failed
    unclear = any(isinstance(one, (OSError, ImportError, SystemError)) for one in seen)
    return unclear and not _room_for_a_library()


def _room_for_a_library() -> bool:
    try:
        mmap.mmap(-1, _LIBRARY).close()
    except OSError:
        return False
    return True
