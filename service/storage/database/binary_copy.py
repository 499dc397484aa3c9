"""Rows in PostgreSQL's binary format of COPY, built as arrays instead of row by row.

A row is a 16-bit number of fields, then for each field a 32-bit length and that many bytes, all big-endian; the length
-1 and no bytes are NULL (PostgreSQL's manual, "COPY", "Binary Format"). Every row of a block is laid out at its full
width first; the bytes that a row does not have are dropped afterwards.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag.service.storage.database.blocks import Block, Target

#: Signature, flags (none) and the length of the extension of the header (none).
HEADER: Final = b"PGCOPY\n\xff\r\n\0" + struct.pack(">ii", 0, 0)
TRAILER: Final = struct.pack(">h", -1)
_LENGTH, _REAL, _WHOLE = ">i4", ">f8", ">i4"
#: Range of a column of integers.
_LEAST, _MOST = -(2**31), 2**31 - 1


def encoded(place: Target, rows: Block) -> bytes:
    """The rows without header and trailer.

    Raises OverflowError for a count that a column of 32-bit integers cannot hold.
    """
    texts = [_Texts(rows.endings), _Texts(rows.flags)]
    form = _form(place, [text.width for text in texts])
    laid = np.zeros(len(rows.cases), dtype=form)
    laid["fields"] = len(place.columns)
    for name, values in (("study", rows.studies), ("case", rows.cases)):
        laid[f"{name}_length"], laid[name] = 4, values
    for name, text in zip(("ending", "flags"), texts, strict=True):
        laid[f"{name}_length"], laid[name] = text.lengths, text.values
    finite = np.isfinite(rows.values)
    for index, whole in enumerate(place.whole):
        column, known = rows.values[:, index], finite[:, index]
        numbers = _whole(place.columns[4 + index], column, known) if whole else column
        width = form[f"value_{index}"].itemsize
        laid[f"value_{index}_length"] = width if known.all() else np.where(known, width, -1)
        laid[f"value_{index}"] = numbers
    return _packed(laid, texts, finite)


def _form(place: Target, widths: Sequence[int]) -> np.dtype[Any]:
    """The layout of a row whose texts are all as long as the longest, and in which nothing is NULL."""
    fields: list[tuple[str, str]] = [("fields", ">i2")]
    for name, kind in (("study", _WHOLE), ("case", _WHOLE), ("ending", f"S{widths[0]}"), ("flags", f"S{widths[1]}")):
        fields += [(f"{name}_length", _LENGTH), (name, kind)]
    for index, whole in enumerate(place.whole):
        fields += [(f"value_{index}_length", _LENGTH), (f"value_{index}", _WHOLE if whole else _REAL)]
    return np.dtype(fields)


class _Texts:
    """A column of few different texts: ``values`` as bytes of one width, ``lengths`` of each."""

    def __init__(self, texts: Sequence[str]) -> None:
        kinds: dict[str, int] = {}
        codes = [kinds.setdefault(text, len(kinds)) for text in texts]
        kept = [text.encode() for text in kinds]
        # numpy has no strings without bytes.
        self.width = max(1, *map(len, kept)) if kept else 1
        self.values = np.array(kept, dtype=f"S{self.width}")[codes]
        self.lengths = np.array([len(text) for text in kept], dtype=np.int32)[codes]


def _whole(column: str, values: NDArray[np.float64], known: NDArray[np.bool_]) -> NDArray[np.float64]:
    numbers = np.where(known, values, 0.0)
    if numbers.size and not (numbers.min() >= _LEAST and numbers.max() <= _MOST):
        raise OverflowError(f"{column} has a value outside {_LEAST} to {_MOST}")
    return numbers


def _packed(laid: NDArray[Any], texts: Sequence[_Texts], finite: NDArray[np.bool_]) -> bytes:
    """The rows one after the other, without the bytes of shorter texts and of what is NULL."""
    even = all((text.lengths == text.width).all() for text in texts)
    if even and finite.all():
        return laid.tobytes()
    form = laid.dtype
    assert form.fields is not None
    kept = np.ones((len(laid), form.itemsize), dtype=np.bool_)
    for name, text in zip(("ending", "flags"), texts, strict=True):
        start = form.fields[name][1]
        kept[:, start : start + text.width] = np.arange(text.width) < text.lengths[:, None]
    for index in np.flatnonzero(~finite.all(axis=0)).tolist():
        kind, start = form.fields[f"value_{index}"][:2]
        kept[:, start : start + kind.itemsize] = finite[:, index, None]
    return laid.view(np.uint8).reshape(kept.shape)[kept].tobytes()
