"""The columns of numbers in a page."""

from __future__ import annotations

import base64
import gzip
import re

import numpy as np


def column(page: str, name: str, kind: str) -> np.ndarray:
    """(n,) one of them, unpacked; `kind` as numpy names it."""
    found = re.search(rf'id="column-{name}">([^<]*)<', page)
    assert found
    return np.frombuffer(gzip.decompress(base64.b64decode(found.group(1))), kind)
