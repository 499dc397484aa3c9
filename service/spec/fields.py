"""Which fields of a spec say which cases a study has, and specs made of that of a study."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag.worker.limits import MAX_NAME_LENGTH

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping

#: Fields of a spec about tolerances.
TOLERANCE_FIELDS: Final = ("tolerances", "drives", "seed", "draws", "correlations")
#: Fields of a spec that say which cases a study has.
WHICH_CASES: Final = frozenset({"axes", "combine", "exclude", "refine", "goal", "calibrate", *TOLERANCE_FIELDS})


def without_cases(spec: Mapping[str, Any], kept: Collection[str] = ()) -> dict[str, Any]:
    """``spec`` without the fields that say which cases it has, except for those that are ``kept``."""
    return {key: value for key, value in spec.items() if key not in WHICH_CASES or key in kept}


def renamed(name: str, suffix: str) -> str:
    """The name of a study that follows from another one, cut to the length that names can have."""
    return name[: MAX_NAME_LENGTH - len(suffix)] + suffix
