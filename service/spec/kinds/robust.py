"""Goals about the drives of a design: quantiles of results, and the yield."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.spec.node import Node

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.report import Report

#: Fields of a goal or a constraint about the drives.
ROBUST: Final = ("quantile", "yield")
#: JSON Schema of the quantile.
QUANTILE: Final[dict[str, Any]] = {
    "type": ["number", "string"],
    "description": "the quantile of the result over the drawn drives instead of that of the nominal drive: a share, as "
    'in "5 %"',
}


def read_quantile(item: Node) -> dict[str, float] | None:
    """The quantile of a goal or a constraint, by name; empty without one, None, and a fault recorded, if invalid."""
    if "quantile" not in item:
        return {}
    share = item["quantile"].share(0.0, 1.0)
    return None if share is None else {"quantile": share}


def check_drives(
    report: Report, best: Sequence[Mapping[str, Any]], constraints: Sequence[Mapping[str, Any]], drives: int
) -> None:
    """Record goals about drives in a study without tolerances, and tolerances without such a goal."""
    about = [
        f"/goal/{part}/{index}/{name}"
        for part, items in (("best", best), ("subject_to", constraints))
        for index, item in enumerate(items)
        for name in ROBUST
        if name in item
    ]
    if drives and not about:
        report.fault(
            "/tolerances", "not-used", "have no effect on this goal", allowed="goals or constraints with `quantile` or "
            "`yield`; a study of a design afterwards shows what tolerances make of it",
        )  # fmt: skip
    for where in about if not drives else ():
        report.fault(where, "conflict", "is about the drives, of which there is one only",
                     allowed="`tolerances` in the spec")  # fmt: skip
