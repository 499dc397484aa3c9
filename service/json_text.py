"""JSON as it is sent and written."""

from __future__ import annotations

import json
from typing import Any


def to_bytes(data: Any) -> bytes:
    """``data`` as JSON text in UTF-8. NaN and infinities are a fault (ValueError); a lone surrogate stays an escape."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return text.encode("utf-8", errors="backslashreplace")
