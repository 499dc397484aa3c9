"""JSON for answers and files."""

from __future__ import annotations

import json
import math
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    import numpy as np
    from numpy.typing import NDArray


def to_bytes(data: Any) -> bytes:
    """``data`` as JSON text in UTF-8. NaN and infinities raise ValueError; a lone surrogate stays escaped."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", errors="backslashreplace")


def list_document(name: str, items: Iterable[bytes]) -> Iterator[bytes]:
    """A JSON object whose only field is a list of the ``items``, which are JSON texts, in pieces: one in each line."""
    yield b'{"%s": [' % name.encode("ascii")
    for number, item in enumerate(items):
        yield (b",\n" if number else b"\n") + item
    yield b"\n]}\n"


def timestamp(moment: datetime) -> str:
    """A time as RFC 3339 text in UTC with six decimals, whatever its fraction: ``2027-01-31T22:00:00.000000Z``."""
    return moment.astimezone(UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")


def numbers(values: NDArray[np.float64], count: bool = False) -> list[float | int | None]:
    """Doubles as JSON numbers, NaN as null; counts as integers."""
    return [None if math.isnan(value) else int(value) if count else value for value in values.tolist()]
