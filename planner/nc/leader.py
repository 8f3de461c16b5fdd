"""Text before the first % of a program: names of parts, lists of tools, what a serial line needed. Controls skip it.

It is skipped here too where it cannot be a program: some line of it is no words, and no line that is words has a code or a coordinate.
Parameters and expressions (# [ < =) are no such text.
"""

from __future__ import annotations

import re

import numpy as np

from planner.nc.lexer import FAULT, split_words

_LOOKED_AT = 20_000  # bytes at the start of a file in which the first % is looked for
_SHOWN = 30  # characters of the text in the note
_PERCENT = re.compile(rb"^[ \t]*%", re.MULTILINE)
_LANGUAGE = re.compile(rb"[#\[<=]")
_DOES = np.frombuffer(b"GMXYZ", dtype=np.uint8)


def without_leader(data: bytes) -> tuple[bytes, str]:
    """The program with blanks for the text before its first %, and the beginning of that text; ("" where there is none).

    Offsets and lines stay as they are.
    """
    found = _PERCENT.search(data[:_LOOKED_AT])
    text = data[: found.start()] if found else b""
    if not text.strip() or _LANGUAGE.search(text) or not _is_text(text):
        return data, ""
    shown = " ".join(text.decode("utf-8", "replace").split())[:_SHOWN]
    return re.sub(rb"[^\r\n]", b" ", text) + data[len(text) :], shown


def _is_text(text: bytes) -> bool:
    words = split_words(text, block_delete=False)
    odd = np.add.reduceat(words.letter == FAULT, words.first[:-1]) if len(words.letter) else np.zeros(0)
    does = np.add.reduceat(np.isin(words.letter, _DOES), words.first[:-1]) if len(words.letter) else odd
    return bool((odd > 0).any() and not ((odd == 0) & (does > 0)).any())
