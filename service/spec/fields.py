"""Fields of a spec about tolerances, and names of studies that follow from others."""

from __future__ import annotations

from typing import Final

from sprag.worker.limits import MAX_NAME_LENGTH

#: Fields of a spec about tolerances.
TOLERANCE_FIELDS: Final = ("tolerances", "drives", "seed", "draws", "correlations")


def renamed(name: str, suffix: str) -> str:
    """The name of a study that follows from another one, cut to the length that names can have."""
    return name[: MAX_NAME_LENGTH - len(suffix)] + suffix
