"""Pictures of cells: a PNG inside an SVG, one pixel for each small cell."""

from __future__ import annotations

import struct
import zlib
from base64 import b64encode
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

_SIGNATURE: Final = b"\x89PNG\r\n\x1a\n"


def data_address(places: NDArray[np.int64], colours: Sequence[str]) -> str:
    """The address ``data:`` of a PNG whose pixels have the colours at some ``places``, from the top; none at -1."""
    height, width = places.shape
    # The last colour of the palette is transparent.
    rows = np.where(places < 0, len(colours), places).astype(np.uint8)
    raw = b"".join(b"\0" + row.tobytes() for row in rows)
    palette = b"".join(bytes.fromhex(colour[1:]) for colour in (*colours, "#000000"))
    chunks = (
        (b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)),
        (b"PLTE", palette),
        (b"tRNS", b"\xff" * len(colours) + b"\0"),
        (b"IDAT", zlib.compress(raw, 9)),
        (b"IEND", b""),
    )
    made = _SIGNATURE + b"".join(map(_chunk, *zip(*chunks, strict=True)))
    return f"data:image/png;base64,{b64encode(made).decode()}"


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
