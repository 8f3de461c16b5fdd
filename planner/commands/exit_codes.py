"""Exit codes of the command `planner`; 0 is done and verified. Nothing is imported here: this is loaded before everything else."""

FAILED = 1  # planned, but the verdict failed
BAD_INPUT = 2
NOT_SOLVED = 3  # or out of memory
BUG = 70  # EX_SOFTWARE of sysexits.h
INTERRUPTED = 130  # 128 + SIGINT, what shells report
BROKEN_PIPE = 141  # 128 + SIGPIPE: the reader of the output has gone
