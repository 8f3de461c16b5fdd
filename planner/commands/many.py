"""`planner plan` with several programs: each in a process of its own, so that one that fails ends alone, as many at a time
as there are cores. What it writes stands in DIR/NAME, all or nothing, so that Ctrl-C loses only what was not finished.
"""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from planner.base.errors import InputError
from planner.base.files import STDIN
from planner.base.threads import cores
from planner.commands.interrupt import interrupts_raise
from planner.commands.progress import ProgressBar
from planner.commands.terminal import BUG, CODES, INTERRUPTED, NOT_SOLVED, say, say_json, show

# By the exit code of a program's process.
OUTCOMES = {code: outcome for outcome, code in CODES.items()} | {INTERRUPTED: "interrupted"}
CHILD = "from planner.commands.many import end_with_the_first as begin; begin(); from planner.cli import main; main()"
# Signals that no fault of a process raises: of a system whose memory is used up, of a batch system, of
# `kill`.
FROM_OUTSIDE = (signal.SIGTERM, 9)  # 9 is SIGKILL, which Windows does not have
PERHAPS_MEMORY = "perhaps because the memory is used up; plan it alone, or with fewer --threads"
ENDING = 5.0  # that processes get to remove what they have half written [s]


@dataclass(frozen=True, kw_only=True)
class Done:
    """The outcome of a program: exit code, the content of `summary.json` if there is any, and what the
    process said."""

    job: Path
    code: int
    summary: dict[str, Any] = field(default_factory=dict)
    said: str = ""

    @property
    def outcome(self) -> str:
        """The outcome by its exit code: "passed", "failed", "refused" ..."""
        return OUTCOMES.get(self.code, "a bug")


def folders_of(jobs: Sequence[Path], output: Path) -> list[Path]:
    """Where the files of each program go: DIR/NAME without the suffix, with it where another program has the
    same name otherwise.

    Raises InputError if two programs have the same name, or one is there twice.
    """
    stems = [job.stem for job in jobs]
    names = [job.name if stems.count(job.stem) > 1 else job.stem for job in jobs]
    for name in names:
        same = [str(job) for job, other in zip(jobs, names, strict=True) if other == name]
        if len(same) > 1:
            raise InputError(
                f"{' and '.join(same)} would be written into the same {output / name}; plan them one by one"
            )
    return [output / name for name in names]


def plan_many(
    jobs: Sequence[Path],
    options: Sequence[str],
    output: Path | None,
    *,
    threads: int | None,
    quiet: bool,
    as_json: bool,
) -> int:
    """Plan programs side by side and print a table of them; returns the largest exit code, 130 after Ctrl-C.

    options : of the command line, for each of them
    output  : directory for a directory of each; None to write nothing
    threads : to use in all; None for one per core
    """
    if Path(STDIN) in jobs:
        raise InputError(f"{STDIN} is the standard input, which holds one program")
    if len({job.resolve() for job in jobs}) < len(jobs):
        raise InputError("a program is named twice")
    folders = [None] * len(jobs) if output is None else folders_of(jobs, output)
    many = min(threads or cores(), len(jobs))
    each = ["--threads", str(max((threads or cores()) // many, 1)), *options]
    end, held_open = os.pipe()  # the end of this pipe tells the processes that this one has gone
    tasks = [
        _Task(job, [*each, *([] if folder is None else ["-o", str(folder)])], end)
        for job, folder in zip(jobs, folders, strict=True)
    ]
    done: dict[Path, Done] = {}
    interrupted = False
    with os.fdopen(held_open, "wb"), ProgressBar(quiet=quiet) as progress, interrupts_raise():
        pool = ThreadPoolExecutor(max_workers=many)
        try:
            running = [pool.submit(task.run) for task in tasks]
            progress.count(0, len(jobs))
            for future in as_completed(running):
                found = future.result()
                done[found.job] = found
                if not quiet:
                    time = found.summary.get("cycle_time_s")
                    took = "" if time is None else f"{time:.4f} s, "
                    say(f"{found.job}: {took}{found.outcome}", err=True)
                progress.count(len(done), len(jobs))
        except KeyboardInterrupt:
            interrupted = True
            pool.shutdown(wait=False, cancel_futures=True)
            _end(tasks)
        pool.shutdown(wait=True, cancel_futures=True)
    rows = [done.get(job) or Done(job=job, code=INTERRUPTED) for job in jobs]
    _report(rows, as_json)
    return INTERRUPTED if interrupted else max(row.code for row in rows)


class _Task:
    """A program and the process that plans it."""

    def __init__(self, job: Path, options: Sequence[str], stdin: int):
        self.job, self._options, self._stdin = job, options, stdin
        self.unwanted = False  # Ctrl-C came
        self.process: subprocess.Popen[str] | None = None

    def run(self) -> Done:
        """Start the process, wait for it, and read what it says."""
        path = os.pathsep.join(os.path.abspath(place) for place in sys.path)
        command = [sys.executable, "-P", "-c", CHILD, "plan", *self._options, "--json", "-q", "--"]
        with subprocess.Popen(
            [*command, str(self.job)],
            env={**os.environ, "PYTHONPATH": path},
            stdin=self._stdin,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            errors="replace",
        ) as self.process:
            if self.unwanted:
                self.process.terminate()
            text, said = (stream.strip() for stream in self.process.communicate())
            code = self.process.returncode
        summary: dict[str, Any] = {}
        with suppress(ValueError):
            summary = json.loads(text)
        if -code in FROM_OUTSIDE:
            said, code = f"its process was ended from outside (signal {-code}), {PERHAPS_MEMORY}", NOT_SOLVED
        elif code < 0:
            said, code = f"its process was ended by signal {-code}; {said}".rstrip("; "), BUG
        return Done(job=self.job, code=code, summary=summary, said=said)


def _end(tasks: Sequence[_Task]) -> None:
    """End processes as Ctrl-C does, and harder where that does not help."""
    for task in tasks:
        task.unwanted = True
    processes = [task.process for task in tasks if task.process is not None]
    for number in (signal.SIGINT, signal.SIGTERM):
        for process in processes:
            with suppress(OSError, ValueError):  # gone already; no such signal on Windows
                process.send_signal(number)
        for process in processes:
            with suppress(subprocess.TimeoutExpired):
                process.wait(ENDING)


def _report(rows: Sequence[Done], as_json: bool) -> None:
    """Print the table, and why programs did not pass."""
    if as_json:
        programs = [
            {"program": str(row.job), "exit_code": row.code, "outcome": row.outcome, "said": row.said, "summary": row.summary or None}
            for row in rows
        ]  # fmt: skip
        say_json({"programs": programs})
        return
    from planner.report.tables import assumed_lines, programs_table

    for row in rows:
        for line in assumed_lines(row.summary.get("assumptions", ())):
            say(f"{row.job}: {line}")
    show(programs_table([(str(row.job), row.outcome, row.summary, row.said) for row in rows]))


def end_with_the_first() -> None:
    """Let this process end, as Ctrl-C ends it, when the one that has started it ends."""
    if signal.getsignal(signal.SIGINT) is not signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)

    def wait() -> None:
        os.read(0, 1)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=wait, daemon=True).start()
