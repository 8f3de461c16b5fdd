"""A run: suites by ways, a process for each way, rows appended to results/SUITE.jsonl as soon as they are measured."""

from __future__ import annotations

import contextlib
import dataclasses
import fnmatch
import json
import math
import selectors
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from threading import Lock
from typing import IO

from joblib import Parallel, delayed

from benchmarks.record import RESULTS, planner_state, provenance
from benchmarks.runner import rows
from benchmarks.runner.measure import REPEATS
from benchmarks.runner.rows import ERROR, METHOD, OVER_LIMIT, Row, line_of
from benchmarks.runner.suites import ROOT, SUITES, Job
from benchmarks.runner.ways import MODELS, PEERS, way_of
from benchmarks.runner.worker import READY
from planner.base.errors import InputError

FOLDER = RESULTS
LIMIT = 120.0  # of one call [CPU s]
# A process is killed where it does not answer: repeats of a call within its limit, on a core that others use too.
PATIENCE, START = 6.0, 900.0  # times the limit [-]; for warm-up with kernels to compile [s]
NONE, ALL = "none", "all"


@dataclass(frozen=True, kw_only=True)
class Request:
    """What to run.

    suites  : their names
    methods : names of ways of the planner; None for the suite's
    peers   : names of peers and models; None for the suite's
    limit   : of one call [CPU s]
    repeats : of one pair at most
    only    : patterns of job names; empty for all
    count   : jobs of each suite, the first ones; None for all
    processes : ways that are measured at the same time; above 1 all times are marked as not quiet
    resume  : leave pairs alone that the file has of this commit
    folder  : where files of rows are
    """

    suites: tuple[str, ...]
    methods: tuple[str, ...] | None = None
    peers: tuple[str, ...] | None = None
    limit: float = LIMIT
    repeats: int = REPEATS
    only: tuple[str, ...] = ()
    count: int | None = None
    processes: int = 1
    resume: bool = False
    folder: Path = FOLDER

    def __post_init__(self) -> None:
        """Raises InputError for unknown suites and ways, and for a limit or numbers that are not positive."""
        for suite in self.suites:
            if suite not in SUITES:
                raise InputError(f"no suite '{suite}'; there are {', '.join(SUITES)}")
        for way in (*(self.methods or ()), *(self.peers or ())):
            if way not in (NONE, ALL):
                way_of(way)
        numbers = {"repeats": self.repeats, "processes": self.processes, "count": self.count}
        if not 0.0 < self.limit < math.inf or any(one is not None and one <= 0 for one in numbers.values()):
            said = ", ".join(f"{name} {one}" for name, one in numbers.items())
            raise InputError(f"limit {self.limit:g}, {said}; each must be above 0")

    def ways(self, suite: str) -> list[str]:
        """Names of the ways of a suite."""
        usual = SUITES[suite].ways
        others = (*PEERS, *MODELS)
        own = tuple(way for way in usual if way_of(way).kind == METHOD)
        foreign = tuple(way for way in usual if way_of(way).kind != METHOD)
        return [*_chosen(self.methods, own, usual), *_chosen(self.peers, foreign, others)]

    def jobs(self, suite: str) -> list[Job]:
        """Jobs of a suite."""
        patterns = self.only or ("*",)
        found = [
            job for job in SUITES[suite].jobs() if any(fnmatch.fnmatchcase(job.name, one) for one in patterns)
        ]
        return found[: self.count]


def _chosen(asked: tuple[str, ...] | None, usual: tuple[str, ...], every: tuple[str, ...]) -> tuple[str, ...]:
    if asked is None:
        return usual
    if asked == (ALL,):
        return every
    return () if asked == (NONE,) else asked


def run(request: Request) -> dict[str, list[Row]]:
    """Measure what is asked for and return the new rows by suite; rows of earlier runs stay in the files."""
    about, commit = provenance(), planner_state()
    made: dict[str, list[Row]] = {}
    for suite in request.suites:
        made[suite] = []
        if (why := SUITES[suite].absent()) is not None:
            print(f"{suite}: skipped: {why}", flush=True)
            continue
        file = request.folder / f"{suite}.jsonl"
        known = rows.read(file).rows if file.is_file() else {}
        done = {key for key, row in known.items() if request.resume and row.commit == commit}
        pairs = _pairs(request, suite, done)
        if not pairs:
            print(f"{suite}: nothing to do", flush=True)
            continue
        rows.append(file, [rows.about_line(about | {"planner": commit})])
        made[suite] = _measured(request, suite, pairs, commit, partial(_kept, file))
        rows.compact(file, {job.name for job in SUITES[suite].jobs()})
    return made


def _pairs(request: Request, suite: str, done: set[rows.Key]) -> dict[str, list[str]]:
    """The jobs of each way that are to be measured."""
    jobs = [job.name for job in request.jobs(suite)]
    pairs = {way: [job for job in jobs if (suite, job, way) not in done] for way in request.ways(suite)}
    return {way: jobs for way, jobs in pairs.items() if jobs}


def _kept(file: Path, row: Row) -> None:
    """Append a row to the file, and tell of it."""
    rows.append(file, [line_of(row)])
    print(_told(row), flush=True)


def _measured(
    request: Request, suite: str, pairs: dict[str, list[str]], commit: str, keep: Callable[[Row], None]
) -> list[Row]:
    """The rows of pairs, each kept as soon as it is measured; so many ways at a time as there may be processes."""
    made: list[Row] = []
    one_at_a_time = Lock()

    def serve(way: str, jobs: list[str]) -> None:
        for row in _of_way(request, suite, way, jobs, commit):
            with one_at_a_time:
                keep(row)
                made.append(row)

    # threads that wait for the ways' processes
    Parallel(n_jobs=request.processes, backend="threading")(delayed(serve)(*one) for one in pairs.items())
    return made


def _of_way(request: Request, suite: str, way: str, jobs: list[str], commit: str) -> Iterator[Row]:
    worker: Worker | None = None
    for job in jobs:
        worker = worker or Worker(way)
        asked = {
            "suite": suite, "job": job, "repeats": request.repeats, "limit": request.limit, "commit": commit,
        }  # fmt: skip
        row = worker.answer(asked, PATIENCE * request.limit + START)
        if not worker.alive:
            worker = None
        yield dataclasses.replace(row, beside=request.processes - 1)
    if worker is not None:
        worker.close()


class Worker:
    """A process that serves one way (worker.py); it is dead after an answer that it owed."""

    def __init__(self, way: str) -> None:
        self.way, self._words = way_of(way), ""
        self._errors = tempfile.TemporaryFile("w+", encoding="utf-8")  # noqa: SIM115
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmarks.runner.worker", way],
            cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._errors, text=True,
        )  # fmt: skip
        self.alive = self._line(START) == READY

    def answer(self, asked: dict[str, object], patience: float) -> Row:
        """The row of a request; a process that dies or does not answer within `patience` [s] is the row's message."""
        line: str | None = ""
        if self.alive:
            stream = _stream(self._process.stdin)
            with contextlib.suppress(BrokenPipeError):
                stream.write(json.dumps(asked) + "\n")
                stream.flush()
                line = self._line(patience)
        if line:
            return rows.row_of_line(json.loads(line), "worker")
        self.close()
        spent = self._process.returncode == -signal.SIGVTALRM
        blank = Row(
            suite=str(asked["suite"]), job=str(asked["job"]), way=self.way.name, kind=self.way.kind,
            status=OVER_LIMIT if line is None or spent else ERROR, commit=str(asked["commit"]),
        )  # fmt: skip
        if spent:
            return dataclasses.replace(
                blank, message=f"more than {asked['limit']:g} CPU s in a call that did not come back"
            )
        late, died = f"no answer within {patience:g} s", f"the process died: {self._words}"
        return dataclasses.replace(blank, message=late if line is None else died)

    def close(self) -> None:
        """End the process."""
        self.alive = False
        self._process.kill()
        self._process.communicate()
        if not self._errors.closed:
            self._words = self._last_words()
            self._errors.close()

    def _line(self, patience: float) -> str | None:
        """The next line, "" at the end, or None after `patience` seconds."""
        stream = _stream(self._process.stdout)
        with selectors.DefaultSelector() as waiting:
            waiting.register(stream, selectors.EVENT_READ)
            if not waiting.select(patience):
                return None
        return stream.readline().strip()

    def _last_words(self) -> str:
        self._errors.seek(0)
        lines = self._errors.read().strip().splitlines()
        return lines[-1] if lines else f"exit code {self._process.returncode}"


def _stream(given: IO[str] | None) -> IO[str]:
    assert given is not None
    return given


def _told(row: Row) -> str:
    time = "" if row.cycle_s is None else f" {row.cycle_s:.6g} s"
    cpu = "" if row.cpu_s is None else f", {row.cpu_s:.3g} CPU s" + (" (busy core)" if row.noisy else "")
    said = "" if row.verdict == rows.PASSED or row.kind == rows.MODEL else f": {row.message[:120]}"
    return f"{row.suite} / {row.job} / {row.way}: {row.status}{time} {row.verdict}{cpu}{said}"
