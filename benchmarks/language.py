"""Programs that compute, in numbers: agreement with LinuxCNC, mutated programs, speed.

python -m benchmarks.language agree 5000     random programs read here and by rs274 (needs Debian's linuxcnc-uspace)
python -m benchmarks.language fuzz 5000      mutated programs of all kinds: none may crash, hang or fill the memory
python -m benchmarks.language speed          a loop that makes a million blocks
"""

from __future__ import annotations

import re
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np

TESTS = Path(__file__).resolve().parent.parent / "tests" / "nc"
BATCH = 200
PIECES = [
    b"#", b"[", b"]", b"#<", b">", b"=", b"o1 ", b"while ", b"endwhile", b"if [1]", b"endif",
    b"M98 P1", b"M99", b"GOTO 10", b"WHILE [1] DO 1",
    b"END 1", b"G65 P1 A1", b"\n", b"N10 ", b"-", b"**", b"1e9", b"o2 sub\n", b"o2 endsub\n",
    b"o2 call\n", b"M2\n", b"%", b"(", b"\xff", b"#0",
]  # fmt: skip


def agree(count: int) -> None:
    """Compare random programs with LinuxCNC and say how many blocks were the same."""
    from test_language import agree as compare

    blocks = done = seed = 0
    while done < count:
        seed += 1
        with tempfile.TemporaryDirectory() as folder:
            blocks += compare(min(BATCH, count - done), 1000 + seed, Path(folder))
        done += min(BATCH, count - done)
        print(f"{done} programs agree, {blocks} blocks", flush=True)


def fuzz(count: int) -> None:
    """Read mutated programs; a bug shows as another exception than InputError."""
    from language_programs import Generator
    from test_language import EXAMPLES
    from test_macros import FANUC

    from planner.base.errors import InputError
    from planner.nc.language import run
    from planner.nc.reader import parse_program

    run.TURNS_MAX, run.ROWS_MAX = 20_000, 20_000
    rng = np.random.default_rng(5)
    seeds = [f"G21 F100\n{text}\nM2\n" for text in [*EXAMPLES, *(macro for macro, _ in FANUC.values())]]
    seen: Counter[str] = Counter()
    longest = 0.0
    for k in range(count):
        text = Generator(rng, risky=True).text() if k % 3 == 0 else seeds[int(rng.integers(len(seeds)))]
        data = bytearray(text.encode())
        for _ in range(int(rng.integers(1, 6))):
            at, what = int(rng.integers(len(data))), int(rng.integers(4))
            if what == 0:
                del data[at : at + int(rng.integers(1, 12))]
            elif what == 1:
                data[at:at] = PIECES[int(rng.integers(len(PIECES)))]
            elif what == 2:
                data[at] = int(rng.integers(256)) or 32
            else:
                data[at:at] = data[at : at + 60]
            data = data or bytearray(b"G0 X1")
        begin = time.process_time()
        try:
            parse_program(bytes(data))
            seen["read"] += 1
        except InputError as fault:
            seen[re.sub(r"[\d#'\"].*", "", fault.message.partition(": ")[2] or fault.message)[:60]] += 1
        except Exception:
            Path("fuzz.ngc").write_bytes(bytes(data))
            print(f"program {k} crashed; it is in fuzz.ngc")
            raise
        longest = max(longest, time.process_time() - begin)
    print(f"{count} programs, longest {longest:.2f} s")
    for name, times in seen.most_common(12):
        print(f"{times:6d}  {name}")


def speed() -> None:
    """Blocks per CPU second of a loop, expansion and execution together."""
    from planner.nc.reader import parse_program

    text = "G21 F1000\n#1=0\no1 while [#1 LT 1000000]\nG1 X[50*COS[#1]] Y[50*SIN[#1]]\n#1=[#1+1]\no1 endwhile\nM2\n"
    parse_program(text.replace("1000000", "10"))  # compiles
    for _ in range(3):
        begin = time.process_time()
        program = parse_program(text)
        taken = time.process_time() - begin
        print(f"{len(program):,} blocks in {taken:.2f} CPU s: {len(program) / taken:,.0f} blocks/s")


if __name__ == "__main__":
    language = TESTS / "language"
    sys.path[:0] = [str(language / name) for name in ("linuxcnc", "fanuc")] + [
        str(language), str(TESTS), str(TESTS.parent)
    ]  # fmt: skip
    command, *rest = sys.argv[1:] or ["speed"]
    {"agree": agree, "fuzz": fuzz}[command](int(rest[0]) if rest else 1000) if command != "speed" else speed()
