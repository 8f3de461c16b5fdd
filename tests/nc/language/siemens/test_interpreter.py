"""Random Sinumerik programs against another interpreter: nc-gcode-interpreter 0.1.9 (PyPI), whose answers are in the repository.

    python tests/nc/language/siemens/test_interpreter.py     in an environment with that package: writes them again

It knows no R parameters and no functions, takes + and * of one sum from left to right (here brackets stand in it), and has numbers of
single precision.
"""

from __future__ import annotations

import gzip
import json
import random
from pathlib import Path

import pytest

ANSWERS = Path(__file__).with_name("interpreter_answers.json.gz")
COUNT = 150
SINGLE = 2e-5  # of single precision, at values below 100


def program(rng: random.Random) -> str:
    """Variables, frames, loops and branches."""
    value = lambda: rng.choice(  # noqa: E731
        ["VAA", "VAB", f"{rng.random() * 9:.2f}", "VAA+(VAB*2)", "(VAA-VAB)*VAA", "VAB-(VAA*3)", "VAA/4+1"]
    )
    digit = lambda: rng.randint(-9, 9)  # noqa: E731
    lines = [
        "G17 G90 G71",
        f"DEF REAL VAA={rng.randint(1, 4)}",
        f"DEF REAL VAB={rng.random() * 3:.2f}",
        "DEF INT CNT",
        "G0 X1 Y2 Z3",
    ]
    for _ in range(rng.randint(4, 10)):
        lines += rng.choice(
            [
                [f"G1 X={value()} Y={value()} F{rng.randint(100, 900)}"],
                [f"Z={value()}"],
                [f"TRANS X{digit()} Y{digit()}", f"G1 X{digit()} Y{digit()} Z1"],
                [f"ATRANS X{digit()}", f"G1 X{digit()} Y{digit()} Z2"],
                ["CNT=0", f"WHILE CNT<{rng.randint(1, 4)}", "CNT=CNT+1", "G1 X=CNT Y=CNT*VAA", "ENDWHILE"],
                [f"IF VAA>{rng.randint(1, 4)}", f"G1 X{digit()}", "ELSE", f"G1 Y{digit()}", "ENDIF"],
                [f"FOR CNT=1 TO {rng.randint(1, 3)}", "G1 Z=CNT", "ENDFOR"],
                [f"VAA={value()}"],
            ]
        )
    return "\n".join(lines) + "\nM30\n"


def places(rows: list[list[float | None]]) -> list[list[float]]:
    """Those that are known and differ from the one before."""
    found: list[list[float]] = []
    for row in rows:
        known = [value for value in row if value is not None]
        if len(known) == 3 and (
            not found or max(abs(a - b) for a, b in zip(known, found[-1], strict=True)) > SINGLE
        ):
            found.append(known)
    return found


@pytest.mark.shows(
    "read-siemens", "compared: nc-gcode-interpreter 0.1.9, recorded answers to random programs"
)
def test_another_interpreter_comes_to_the_same_places() -> None:
    import numpy as np

    from planner.machine import load_machine
    from planner.nc.reader import parse_program
    from planner.nc.reading import Reading

    answers = json.loads(gzip.decompress(ANSWERS.read_bytes()))
    assert len(answers) == COUNT
    mill = load_machine("mill")
    for text, rows in answers:
        found = parse_program(text, mill, Reading(dialect="siemens"))
        np.testing.assert_allclose(places(found.end.tolist()), places(rows), atol=SINGLE, err_msg=text)


def write() -> None:
    """The answers of the other interpreter."""
    from nc_gcode_interpreter import nc_to_dataframe  # type: ignore[import-not-found]

    answers = []
    for seed in range(COUNT):
        text = program(random.Random(seed))
        frame, _ = nc_to_dataframe(text)
        columns = [frame[axis].to_list() for axis in "XYZ"]
        answers.append(
            [text, [[None if v is None else round(v, 5) for v in row] for row in zip(*columns, strict=True)]]
        )
    ANSWERS.write_bytes(gzip.compress(json.dumps(answers).encode(), mtime=0))


if __name__ == "__main__":
    write()
