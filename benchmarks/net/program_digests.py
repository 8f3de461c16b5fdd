"""Digests of what the reader makes of thousands of programs, to see whether a change of the reader changes a program.

    python -m benchmarks.net.program_digests [--write FILE] [--compare FILE] [--count N]

One digest stands for a program read with one machine and settings: all arrays of `Program`, its notes, events, calls and limits, or the
error and all faults; then its description (`planner info`), its expanded text and the program with half of its feeds. The
programs are those of the folder of real programs, the texts that stand in the tests, mutants of both, and random ones of the tests'
and the benchmarks' generators: RS274, its language, lathes, splines, Fanuc's, Heidenhain's and Sinumerik's, printers, drawings.
Compare two states of the code with the same texts: `--write` before, `--compare` after.
"""

from __future__ import annotations

import argparse
import ast
import dataclasses
import gzip
import hashlib
import importlib
import json
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign.programs import dense, mixed
from benchmarks.fuzz.programs import ENDINGS, ROOT, a_machine, a_reading, load_programs, mutant
from benchmarks.fuzz.settings import make_drawing
from planner.base.errors import InputError
from planner.machine.files import machine_from_dict

SHARED = ROOT.parent / "shared" / "nc"
TESTS = ROOT / "tests" / "nc"
COUNT = 100  # random programs of each generator, and ten times as many mutants
MUTANTS_OF_A_TEXT = 5  # with that count, else in proportion
WHOLE = 400_000  # bytes: longer programs are not described, expanded and written again

Case = tuple[str, bytes, Any, Any, str]  # name, text, machine, settings, file name


def main() -> None:
    """Write digests, or compare them with those of a file: exit code 1 where one differs."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", type=Path, help="write the digests")
    parser.add_argument("--compare", type=Path, help="compare with digests that were written")
    parser.add_argument("--count", type=int, default=COUNT, help="random programs of each generator")
    options = parser.parse_args()
    digests = {name: digest_of(*case) for name, *case in cases(options.count)}
    print(f"{len(digests)} programs, {len(set(digests.values()))} different digests")
    if options.write:
        options.write.write_bytes(gzip.compress(json.dumps(digests, indent=0).encode(), mtime=0))
    if options.compare:
        sys.exit(_compared(json.loads(gzip.decompress(options.compare.read_bytes())), digests))


def _compared(before: dict[str, str], after: dict[str, str]) -> int:
    """Say which digests differ; 1 if any does."""
    other = [name for name in before if name in after and before[name] != after[name]]
    print(*other, sep="\n")
    print(
        f"{len(other)} differ; {len(before.keys() - after.keys())} gone, {len(after.keys() - before.keys())} new"
    )
    return int(bool(other))


def cases(count: int) -> Iterator[Case]:
    """The programs by family and digest of their text, each with the usual settings and with some by chance."""
    for family, text in _texts(count):
        content = hashlib.sha256(text).hexdigest()
        rng = np.random.default_rng([42, int(content[:8], 16)])
        machine, reading = a_machine(rng), a_reading(rng)
        name = f"{family} {content[:12]}"
        ending = family.rpartition(".")[2] if "." in family else str(rng.choice(ENDINGS))
        yield f"{name} as it is", text, None, type(reading)(), f"a.{ending}"
        yield f"{name} by chance", text, machine, reading, f"a.{ending}"


def _texts(count: int) -> Iterator[tuple[str, bytes]]:
    for file in sorted(SHARED.glob("*")):
        yield f"real {file.name}", file.read_bytes()
    written = sorted(set(_written_in_tests()))
    for text in written:
        yield "test", text
    makers = _generators()
    for n, (name, make) in enumerate(makers.items()):
        rng = np.random.default_rng([7, n])
        for _ in range(10 * count if name == "mutant" else count):
            yield name, make(rng)
    for n, text in enumerate(written):
        rng = np.random.default_rng([8, n])
        for _ in range(-(-MUTANTS_OF_A_TEXT * count // COUNT)):
            yield "mutant of a test", mutant(rng, [], text)


def _all_axes() -> Any:
    """A machine with rotary axes and an extruder."""
    axis = {"velocity": 100.0, "acceleration": 1000.0, "jerk": 1e5}
    axes = {letter: dict(axis) for letter in "xyzabce"}
    return machine_from_dict({"name": "all axes", "tolerance": 0.02, "dt": 1e-3, "axes": axes})


def _generators() -> dict[str, Callable[[np.random.Generator], bytes]]:
    sys.path[:0] = [str(TESTS), str(TESTS / "language")]
    generator = importlib.import_module("language_programs").Generator
    machine = _all_axes()
    texts: dict[str, Callable[[np.random.Generator], str]] = dict(importlib.import_module("random_nc").KINDS)
    texts |= {
        "language": lambda rng: generator(rng).text(),
        "risky": lambda rng: generator(rng, risky=True).text(),
        "together": importlib.import_module("random_together").together,
        "mixed": lambda rng: mixed(rng, machine),
        "dense": dense,
    }
    return {name: lambda rng, make=make: make(rng).encode() for name, make in texts.items()} | {
        "mutant": lambda rng: mutant(rng, load_programs(SHARED)),
        "drawing.plt": lambda rng: make_drawing(rng, None, None),  # type: ignore[arg-type]
    }


def _written_in_tests() -> Iterator[bytes]:
    """Texts of several lines that stand in the tests of programs."""
    for file in sorted(TESTS.rglob("test_*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str | bytes):
                text = node.value.encode() if isinstance(node.value, str) else node.value
                if b"\n" in text.strip() or b";" in text:
                    yield text


def digest_of(text: bytes, machine: Any, reading: Any, source: str) -> str:
    """The digest of all that the reader says of a text."""
    from planner.nc.reader import interpret

    total = hashlib.sha256()
    try:
        program, faults = interpret(text, machine, reading, source=source)
        for part in (program, [(fault.line, fault.column, fault.message) for fault in faults]):
            _add(total, part)
        if len(text) < WHOLE:
            for more in _further(text, machine, reading, source, program, bool(len(faults))):
                _add(total, more)
    except InputError as fault:
        _add(total, ["InputError", str(fault)])
    return total.hexdigest()[:16]


def _further(
    text: bytes, machine: Any, reading: Any, source: str, program: Any, faulty: bool
) -> Iterator[Any]:
    from planner.nc.info import describe
    from planner.nc.writer import flat_program, retimed

    yield repr(describe(program, lines=1, unsupported=()))
    if faulty:
        return
    flat = flat_program(text, machine, reading, source=source)
    yield flat and flat[0]
    try:
        yield retimed(text, program, program.feed / 2.0)
    except (ValueError, IndexError) as fault:  # of drawings and programs that are expanded
        yield str(fault)


def _add(total: Any, part: Any) -> None:
    """A record, a sequence, an array or a value, without names."""
    if dataclasses.is_dataclass(part):
        for field in dataclasses.fields(part):
            _add(total, getattr(part, field.name))
    elif isinstance(part, np.ndarray):
        total.update(f"{part.dtype}{part.shape}".encode())
        total.update(np.ascontiguousarray(part).tobytes())
    elif isinstance(part, str | bytes | int | float | None):
        total.update(repr(part).encode())
    else:
        total.update(b"[")
        for each in part:
            _add(total, each)
        total.update(b"]")


if __name__ == "__main__":
    main()
