"""The designs of a study with a goal as a table."""

from __future__ import annotations

from itertools import chain
from typing import Any

from sprag.service.cli.console import show_table
from sprag.service.cli.shown import heading
from sprag.service.languages import _


def show_designs(found: dict[str, Any]) -> None:
    """A line for each design, the best first."""
    counts = found["counts"]
    parts = [
        _("{count} designs", count=counts["known"]),
        _("{count} feasible", count=counts["feasible"]),
        _("{count} on the front", count=counts["front"]),
    ]
    if counts["pending"]:
        parts.append(_("{count} still to be run", count=counts["pending"]))
    columns = [(name, True) for name in (_("design"), _("case"))]
    columns += [(_lines(goal["result"], goal["unit"]), True) for goal in found["best"]]
    columns += [(_lines(one["name"], one["unit"]), True) for one in found["variables"]]
    limited, points = _limited(found), len(found["at"])
    columns += [
        (_lines(name if points == 1 else _("{name} at {number}", name=name, number=number), unit), True)
        for name, unit in limited.items()
        for number in range(1, points + 1)
    ]
    rows = [
        (
            design["design"],
            design["cases"][0],
            *design["goals"].values(),
            *design["variables"].values(),
            *chain.from_iterable(design["results"][name] for name in limited),
            *(design[name] for name in ("feasible", "exact", "rank")),
            ", ".join(dict.fromkeys([*filter(None, design["regimes"] or ()), *design["flags"]])),
        )
        for design in found["designs"]
    ]
    columns += [(_("feasible"), False), (_("exact"), False), (_("rank"), True), (_("motion"), False)]
    show_table(", ".join(parts), columns, rows)


def _limited(found: dict[str, Any]) -> dict[str, str]:
    """Names and units of the results of limits; without those that the columns of goals show."""
    goals = {goal["result"] for goal in found["best"]} if len(found["at"]) == 1 else ()
    return {limit["result"]: limit["unit"] for limit in found["subject_to"] if limit["result"] not in goals}


def _lines(name: str, unit: str) -> str:
    """The heading of a narrow column: a line for each part of the name, and one for the unit."""
    return heading(name, unit).replace(".", ".\n").replace(" ", "\n")
