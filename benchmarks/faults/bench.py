"""A folder with a whole result, commands in processes of their own, and what has to hold afterwards (benchmarks/faults)."""

from __future__ import annotations

import json
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import Any

# It says when Python itself has started: what comes before that is none of the planner's.
COMMAND = [sys.executable, "-c", "print('begun', flush=True); from planner.cli import main; main()"]
JOBS = {
    "a": "G21 G90 G94\nG64 P0.05\nG1 X20 F3000\nY20\nX0\nY0\n",
    "b": "G21 G90 G94\nG64 P0.05\nG1 X30 F3000\nY10\nX5\nG2 X0 Y5 R5\nG1 Y0\n",
}
PATIENCE = 900.0  # what does not end for so long is hung, on a machine that does other things too [s]
ENDS = (0, 1, 2, 3)
INTERRUPTED = (130, -signal.SIGINT)
HIDDEN = re.compile(r"\.planner-[0-9a-f]{12}(\..*)?")


class Bench:
    """A folder with two programs and a whole result of each kind of command, made anew where a trial has changed it."""

    def __init__(self, folder: Path) -> None:
        self.folder, self.out = folder, folder / "out"
        self.turn = -1  # of the kinds that come one after the other
        for name, text in JOBS.items():
            (folder / f"{name}.ngc").write_text(text)
        began = time.monotonic()
        assert self.run("plan", "a.ngc", "-o", "out", "-q")[0] == 0
        began = time.monotonic()
        assert self.run("plan", "a.ngc", "-o", "out", "-q")[0] == 0
        self.takes = time.monotonic() - began  # with all kernels at hand [s]

    def start(self, *words: str, of: str = "", **how: Any) -> subprocess.Popen[str]:
        """A command, running; or `of`, Python that is given its words."""
        how = {"cwd": self.folder, "preexec_fn": _listen_to_interrupts} | how
        return subprocess.Popen(
            [*(COMMAND if not of else [sys.executable, "-c", of]), *words],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            **how,
        )

    def run(self, *words: str, **how: Any) -> tuple[int | str, str]:
        """A command: how it ended, and what it said."""
        return ended(self.start(*words, **how))

    def row(
        self, ends: list[tuple[int | str, str]], allowed: tuple[int, ...] = ENDS, **more: Any
    ) -> dict[str, Any]:
        """A trial: exit codes, and what was wrong. The folder has to hold whole results and nothing else."""
        wrong = [text for end, said in ends for text in faults_of(end, said, allowed)]
        wrong += not_whole(self.out)
        left = [path.name for path in self.folder.iterdir() if HIDDEN.fullmatch(path.name)]
        wrong += [f"left: {left}"] if left else []
        if wrong and not whole_again(self):
            wrong.append("the next run does not mend it")
        return {"exits": [end for end, _ in ends], "said": ends[0][1][-200:], "wrong": wrong} | more


@contextmanager
def mounted(place: Path, options: str) -> Iterator[bool]:
    """A file system in memory; False where this process may not mount one."""
    place.mkdir(exist_ok=True)
    done = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(place)], capture_output=True, check=False
    )
    try:
        yield done.returncode == 0
    finally:
        if done.returncode == 0:
            subprocess.run(["umount", "-l", str(place)], check=True)


def _listen_to_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # a shell's background jobs are born with interrupts ignored


def after(process: subprocess.Popen[str], seconds: float) -> None:
    """Wait for so long from when Python has started."""
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(seconds)


def ended(process: subprocess.Popen[str]) -> tuple[int | str, str]:
    """How a process ends, and what it said: on standard error, or else in its table."""
    try:
        out, err = process.communicate(timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return "hung", ""
    return process.returncode, err or out.removeprefix("begun\n")


def faults_of(end: int | str, said: str, allowed: tuple[int, ...]) -> list[str]:
    """What is wrong in an exit code and a message."""
    wrong = [] if end in allowed else [f"exit code {end}: {said[-300:]}"]
    if "bug in planner" in said or "Traceback" in said:
        wrong.append(f"said: {said[-600:]}")
    if end in (2, 3) and not said.strip():
        wrong.append("no sentence")
    return wrong


def not_whole(out: Path) -> list[str]:
    """Why a folder is not the whole result of one run."""
    try:
        listed = json.loads((out / "summary.json").read_text("utf-8"))["sha256"]
    except (OSError, ValueError, KeyError) as fault:
        return [f"summary: {fault!r}"]
    files = [path for path in out.iterdir() if path.name != "summary.json"]
    if folders := [path.name for path in files if path.is_dir()]:
        return [f"left: {folders}"]
    found = {path.name: sha256(path.read_bytes()).hexdigest() for path in files}
    return (
        []
        if found == listed
        else [f"not those of the summary: {sorted(set(found.items()) ^ set(listed.items()))}"]
    )


def whole_again(bench: Bench) -> bool:
    """Whether the next run puts everything right."""
    return bench.run("plan", "a.ngc", "-o", "out", "-q")[0] == 0 and not not_whole(bench.out)
