"""Names of fields of a spec that several of its parts ask for."""

from __future__ import annotations

from typing import Final

#: Fields of a spec about tolerances.
TOLERANCE_FIELDS: Final = ("tolerances", "drives", "seed", "draws", "correlations")
#: Fields of a spec that say which cases a study has.
WHICH_CASES: Final = frozenset({"axes", "combine", "exclude", "refine", "goal", "calibrate", *TOLERANCE_FIELDS})
