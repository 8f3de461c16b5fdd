"""The entry point of the command `planner`; the commands themselves are in `planner.commands.app`.

Its exit codes are in `planner.commands.terminal`.

Nothing is imported before Ctrl-C has its handler, so that an interrupt during the imports ends like any
other.
"""

import gc
import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from planner.commands.app import app

__all__ = ["app", "main"]

# So many new objects before a collection of garbage; Python's 700 means 155 collections, 0.1 s of a plan of
# ten lines (now 10, 0.04 s).
OBJECTS = 10_000


def main() -> None:
    """Entry point of the command `planner`."""
    from planner.commands.interrupt import end_at_interrupts, no_more_interrupts
    from planner.commands.terminal import NOT_SOLVED, is_of_memory

    end_at_interrupts()
    gc.set_threshold(OBJECTS)
    try:
        from planner.commands.app import app
        from planner.commands.terminal import prepare_streams

        prepare_streams()
        app(prog_name="planner")
    except Exception as fault:  # of loading it: commands tell of what they raise themselves
        if not is_of_memory(fault):
            raise
        print("not solved: there is too little memory to load planner and its libraries", file=sys.stderr)
        raise SystemExit(NOT_SOLVED) from None
    finally:
        no_more_interrupts()


def __getattr__(name: str) -> Any:
    if name != "app":
        raise AttributeError(f"module 'planner.cli' has no attribute '{name}'")
    from planner.commands.app import app

    return app
