"""Inputs changed by chance: does each end in a result or in a sentence, in time and in memory?

    python -m benchmarks.fuzz [--minutes 10] [--kinds nc hpgl machine imports trajectory report] [--seconds 600]

NC programs of all dialects, drawings (HPGL), machine files, settings of controls, trajectory files, and pages of plans, each read as
the commands read them, in this process. Of a guided kind (kinds.py) the inputs that reach a new way through the readers are kept
and changed further (coverage.py, corpus.py). A finding is an exception, a warning of a library, a refusal without a
sentence, a page in which a text of the input became an element or a script, or an input that takes longer than `SECONDS`.

Runs add up: seeds go on where the last run of a kind ended, the kept inputs are in `--corpus`, and results/fuzz.json and .md are
written every `SAVED` seconds, with a row for each kind and commit. Ctrl-C ends a run after its current input. Exit code 1 after a
finding; its input is a file, which `--again FILE --kinds KIND` tries again. `--compare` measures what guidance brings instead.
"""

from __future__ import annotations

import argparse
import faulthandler
import resource
import signal
import sys
import tempfile
import time
import traceback
from contextlib import nullcontext
from pathlib import Path

import numpy as np

from benchmarks.fuzz.corpus import Corpus, Input, read_input, write_input
from benchmarks.fuzz.coverage import ROOT, Tracer, sources
from benchmarks.fuzz.kinds import KINDS
from benchmarks.fuzz.run import Finding, Kind, Place, command
from benchmarks.fuzz.tally import Tally, write_guidance

SECONDS = 20  # of computing for one input
STUCK = 300.0  # [s] on the clock, after which the process is ended: a kernel is not interrupted by `SECONDS`
SLOW = 2.0  # [s] inputs that take longer are not changed further: a tenth as many could be tried
MEMORY = 6 << 30  # bytes of address space
SHOWN = 25  # findings whose traceback is printed, of each kind
TRACED = 10  # without guidance only one of so many inputs is traced, to know which lines were reached
SAVED = 20.0  # [s] of computing between two writings
GUIDED = 0.5  # of the inputs, how many are kept ones changed further
SAME_OPTIONS = 0.5  # of those, how many are tried with the settings that the kept one was tried with


class _Hung(BaseException):
    """An input took longer than `SECONDS`."""


class _Stop:
    """Whether Ctrl-C was pressed, or the time of all kinds is over."""

    def __init__(self, seconds: float):
        self.at = time.monotonic() + seconds
        self.pressed = False
        signal.signal(signal.SIGINT, self._press)

    def _press(self, *_: object) -> None:
        self.pressed = True
        print("ends after this input", flush=True)

    def __bool__(self) -> bool:
        return self.pressed or time.monotonic() > self.at


def _hung(*_: object) -> None:
    raise _Hung


def new_input(kind: Kind, seed: int, corpus: Corpus | None, place: Place) -> Input:
    """The input of a seed, from a kept one now and then if there is a corpus."""
    rng = np.random.default_rng([seed, 0])
    kept = corpus.choose(rng, kind.joined) if corpus is not None and rng.random() < GUIDED else None
    if kept is None:
        return Input(kind.make(rng, None, place), seed)
    same = rng.random() < SAME_OPTIONS
    return Input(kind.make(rng, kept.data, place), kept.options if same else seed)


def outcome(kind: Kind, one: Input, place: Place) -> str:
    """How an input ends. Raises Finding with what was found."""
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    try:
        return kind.judge(one.data, np.random.default_rng([one.options, 1]), place)
    except _Hung as fault:
        raise Finding(f"takes more than {SECONDS} s") from fault
    except Finding:
        raise
    except Exception as fault:
        where = traceback.extract_tb(fault.__traceback__)[-1]
        said = f"{type(fault).__name__}: {fault}"[:300]
        raise Finding(f"{Path(where.filename).name}:{where.lineno}: {said}") from fault
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)


def run(name: str, given: argparse.Namespace, stop: _Stop) -> int:
    """Fuzz one kind for so many minutes of computing; the number of findings."""
    kind = KINDS[name]
    tracer = Tracer(sources(kind.readers))
    corpus = Corpus(given.corpus / name, tracer)
    findings = 0
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        place = Place(Path(folder), command)
        corpus.load(lambda one: _tried_again(kind, one, place))
        tally = Tally(name, guided=kind.guided)
        findings += _left_over(corpus, tally)
        began = saved = time.process_time()
        while not stop and time.process_time() < began + 60.0 * given.minutes:
            seed = tally.next_seed
            before = time.process_time()
            one = new_input(kind, seed, corpus if kind.guided else None, place)
            current = write_input(corpus.folder / "current", one, seed)
            faulthandler.dump_traceback_later(STUCK, exit=True)
            try:
                with tracer.watching() if kind.guided or seed % TRACED == 0 else nullcontext():
                    tally.ended(outcome(kind, one, place))
            except Finding as fault:
                findings += 1
                tally.found(str(fault), write_input(corpus.folder / "findings", one, seed))
                if findings <= SHOWN:
                    print(f"---- {name} {seed}", flush=True)
                    traceback.print_exc(file=sys.stdout)
            faulthandler.cancel_dump_traceback_later()
            current.unlink()
            now = time.process_time()
            if kind.guided and tracer.new and now - before < SLOW:
                corpus.keep(one, seed)
            tally.took(now - before)
            if now > saved + SAVED:
                saved = now
                tally.save(corpus)
        if tally.row["inputs"]:
            tally.save(corpus)
    print(name, tally.row["inputs"], tally.row["found"], f"{findings} findings", flush=True)
    return findings


def _left_over(corpus: Corpus, tally: Tally) -> int:
    """An input that ended the process, as a kernel that is stuck does: a finding of this run, which goes on behind it."""
    files = sorted((corpus.folder / "current").glob("*-*"))
    for file in files:
        one, seed = read_input(file), int(file.name.partition("-")[0])
        tally.found(
            "the process ended while it was tried", write_input(corpus.folder / "findings", one, seed)
        )
        tally.next_seed = max(tally.next_seed, seed + 1)
        file.unlink()
    return len(files)


def _tried_again(kind: Kind, one: Input, place: Place) -> None:
    try:
        outcome(kind, one, place)
    except Finding:
        print(f"a kept input ends in a finding: options {one.options}", flush=True)


# ------------------------------------------------------------------------------------------ what guidance brings


def compare(name: str, minutes: float, first: int) -> dict[str, float]:
    """Lines and ways that the same minutes of computing reach with and without guidance, from the same seeds.

    Without guidance nothing is traced while time counts; what was reached is found by trying the inputs a second time.
    """
    kind = KINDS[name]
    with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
        place = Place(Path(folder), command)
        _quietly(kind, new_input(kind, first, None, place), place)  # loads and compiles
        plain = Tracer(sources(kind.readers))
        count = _many(kind, minutes, first, None, place)
        with plain.watching():
            for seed in range(first, first + count):
                _quietly(kind, new_input(kind, seed, None, place), place)
        guided = Tracer(sources(kind.readers))
        corpus = Corpus(Path(folder) / "corpus", guided)
        inputs = _many(kind, minutes, first, corpus, place)
    return {
        "minutes": minutes,
        "inputs": count,
        "lines": plain.lines,
        "ways": sum(map(len, plain.ways.values())),
        "guided inputs": inputs,
        "guided lines": guided.lines,
        "guided ways": sum(map(len, guided.ways.values())),
    }


def _many(kind: Kind, minutes: float, first: int, corpus: Corpus | None, place: Place) -> int:
    """How many inputs so many minutes are enough for."""
    seed, until = first, time.process_time() + 60.0 * minutes
    while time.process_time() < until:
        before = time.process_time()
        one = new_input(kind, seed, corpus, place)
        if corpus is None:
            _quietly(kind, one, place)
        else:
            with corpus.tracer.watching():
                _quietly(kind, one, place)
            if corpus.tracer.new and time.process_time() - before < SLOW:
                corpus.keep(one, seed)
        seed += 1
    return seed - first


def _quietly(kind: Kind, one: Input, place: Place) -> None:
    try:
        outcome(kind, one, place)
    except Finding as fault:
        print(f"finding, options {one.options}: {fault}"[:300], flush=True)


def main() -> None:
    """Fuzz, and write the summary."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=10.0, help="of computing, for each kind")
    parser.add_argument("--seconds", type=float, default=1e9, help="on the clock, for all kinds together")
    parser.add_argument("--kinds", nargs="+", choices=KINDS, default=[*KINDS])
    parser.add_argument("--corpus", type=Path, default=ROOT / ".fuzz", help="folder of kept inputs")
    parser.add_argument("--compare", action="store_true", help="measure what guidance brings")
    parser.add_argument("--seed", type=int, default=0, help="the first, with --compare")
    parser.add_argument("--again", type=Path, help="a file of an input, to be tried once")
    given = parser.parse_args()
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    signal.signal(signal.SIGPROF, _hung)
    if given.again:
        with tempfile.TemporaryDirectory(prefix="fuzz-") as folder:
            print(outcome(KINDS[given.kinds[0]], read_input(given.again), Place(Path(folder), command)))
        return
    if given.compare:
        for name in given.kinds:
            write_guidance(name, compare(name, given.minutes, given.seed))
        return
    stop = _Stop(given.seconds)
    sys.exit(1 if sum([run(name, given, stop) for name in given.kinds]) else 0)


if __name__ == "__main__":
    main()
