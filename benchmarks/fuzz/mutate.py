"""Mutations of texts, of bytes and of JSON values, by chance."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

NUMBER = re.compile(rb"[-+]?\d+(?:\.\d*)?(?:[eE][-+]?\d+)?")
# Numbers that are none, too large, too small, or written as only some programs do. None between 1e-12 and 1e-3: a machine file may have
# them, and with a jerk of 1e-9 mm/s3 a motion takes two hours, and its verdict more than `SECONDS`.
ODD_NUMBERS = (
    *b"0 -0 -1 1 0.5 2 3 7 1e-3 1e-300 5e-324 1e9 1e30 1e300 1.8e308 1e999 -1e300 nan inf -inf NaN +1 .5 5.".split(),
    *b"1_000 0x10 0b1 1,5 1e 1e+ -- 9223372036854775808 340282366920938463463374607431768211456".split(),
    *b"1.0000000000000001 '1' \"1\" true false [] {} [1] 1979-05-27 \xd9\xa3".split(),
    b"",
    b"9" * 400,
    b"0." + b"0" * 400 + b"1",
)
ODD_BYTES = (
    b"\x00",
    b"\xff",
    b"\x1b",
    b"\r",
    b"\n",
    b"\t",
    b" ",
    b'"',
    b"'",
    b"[",
    b"]",
    b"=",
    b"#",
    b";",
    b":",
    b",",
    b"\\",
    b"{",
    b"}",
    b"\xef\xbb\xbf",
)
ODD_VALUES: tuple[Any, ...] = (
    None, True, False, 0, -1, 1, 10**30, 1e308, -1e308, float("nan"), float("inf"), 1e-320, "", "x", "\x00", "\ud800", "é" * 300,
    [], {}, [1], [None], ["x"], {"x": 1}, {"": {}}, [[[[[]]]]],
)  # fmt: skip
LINE_MAX = 20_000  # bytes: a longer line is not doubled


def text_of(
    rng: np.random.Generator, corpus: Sequence[bytes], smallest: float = 1e-12, start: bytes | None = None
) -> bytes:
    """A text of the corpus, or `start`, with one to eight changes; numbers are scaled by `smallest` to 1e12."""
    text = corpus[int(rng.integers(len(corpus)))] if start is None else start
    lines = text.split(b"\n")
    for _ in range(int(rng.integers(1, 9))):
        k, other = (int(v) for v in rng.integers(0, len(lines), 2))
        change = int(rng.integers(0, 12))
        if change == 0 and len(lines) > 1:
            del lines[k]
        elif change == 1:
            lines.insert(k, lines[other])
        elif change == 2:
            lines[k], lines[other] = lines[other], lines[k]
        elif change == 3:
            lines[k] = lines[k][: int(rng.integers(0, len(lines[k]) + 1))]
        elif change == 4 and len(lines[k]) < LINE_MAX:
            lines[k] *= int(rng.integers(2, 5))
        elif change == 5:
            foreign = corpus[int(rng.integers(len(corpus)))].split(b"\n")
            lines.insert(k, foreign[int(rng.integers(len(foreign)))])
        elif change == 6:
            at = int(rng.integers(0, len(lines[k]) + 1))
            new = ODD_BYTES[int(rng.integers(len(ODD_BYTES)))]
            lines[k] = lines[k][:at] + new + lines[k][at + int(rng.integers(0, 3)) :]
        elif change == 7:
            lines[k] += b" " + lines[other]
        else:
            lines[k] = other_number(rng, lines[k], smallest)
    return b"\n".join(lines)


def other_number(rng: np.random.Generator, line: bytes, smallest: float) -> bytes:
    """A line with one of its numbers replaced, scaled or with its sign changed."""
    found = list(NUMBER.finditer(line))
    if not found:
        return line
    one = found[int(rng.integers(len(found)))]
    change = int(rng.integers(3))
    if change == 0:
        new = ODD_NUMBERS[int(rng.integers(len(ODD_NUMBERS)))]
    elif change == 1:
        new = b"-" + one.group().lstrip(b"+-")
    else:
        new = f"{float(one.group()) * 10 ** rng.uniform(np.log10(smallest), 12):.6g}".encode()
    return line[: one.start()] + new + line[one.end() :]


def bytes_of(rng: np.random.Generator, data: bytes) -> bytes:
    """Binary data with bytes changed, cut out, doubled, or cut off."""
    for _ in range(int(rng.integers(1, 6))):
        at = int(rng.integers(0, len(data) + 1))
        change = int(rng.integers(0, 4))
        if change == 0:
            data = data[:at]
        elif change == 1:
            data = data[:at] + data[at + int(rng.integers(0, 50)) :]
        elif change == 2:
            data = data[:at] + data[max(at - 20, 0) : at] + data[at:]
        else:
            data = data[:at] + bytes([int(rng.integers(256))]) + data[at + 1 :]
    return data


def value_of(rng: np.random.Generator, value: Any) -> Any:
    """A JSON value with one of its parts replaced, left out or renamed."""
    if isinstance(value, dict) and value and rng.random() < 0.85:
        key = sorted(value)[int(rng.integers(len(value)))]
        change = rng.random()
        rest = {name: each for name, each in value.items() if name != key}
        if change < 0.1:
            return rest
        if change < 0.2:
            return rest | {key + "_": value[key]}
        return value | {key: value_of(rng, value[key])}
    if isinstance(value, list) and value and rng.random() < 0.7:
        k = int(rng.integers(len(value)))
        return [*value[:k], value_of(rng, value[k]), *value[k + 1 :]]
    return ODD_VALUES[int(rng.integers(len(ODD_VALUES)))]
