"""Ribbons and yields of studies with tolerances as tables."""

from __future__ import annotations

from typing import Any

from sprag.service.cli.console import cell_text, say, show_table
from sprag.service.cli.shown import heading, held_text
from sprag.service.languages import _


def show_ribbon(found: dict[str, Any]) -> None:
    """A table for each line and result: the nominal drive and the quantiles at each place; then the causes."""
    for line in found["lines"]:
        held = held_text({**line["by"], **line["at"]}, found["units"])
        for name, result in line["results"].items():
            result_title = heading(name, found["results"][name]["unit"])
            title = _("{result}, {drives} drives", result=result_title, drives=found["drives"])
            columns = [*_x_column(found), (_("nominal"), True)]
            columns += [(f"{100.0 * p:g} %", True) for p in found["quantiles"]]
            columns += [(_("failed"), True)]
            x = [line["x"]] if found["x"] else []
            rows = list(zip(*x, result["nominal"], *result["values"], line["failed"], strict=True))
            show_table(f"{title}; {held}" if held else title, columns, rows)
            _show_causes(_("causes of the spread of {name}", name=name), result["causes"])


def show_yield(found: dict[str, Any]) -> None:
    """A table for each line: the yield at each place; then the yield everywhere, the causes and the worst drives."""
    title = _(" and ").join(condition["text"] for condition in found["conditions"])
    for line in found["lines"]:
        held = held_text({**line["by"], **line["at"]}, found["units"])
        heads = (_("yield"), _("from"), _("to"), _("drives"), _("failed"))
        columns = [*_x_column(found), *((head, True) for head in heads)]
        x = [line["x"]] if found["x"] else []
        shares = [[_percent(share[part]) for share in line["each"]] for part in ("value", "low", "high")]
        rows = list(zip(*x, *shares, [share["drives"] for share in line["each"]], line["failed"], strict=True))
        show_table(f"{title}; {held}" if held else title, columns, rows)
        if found["x"]:
            say(_("at every place: {share}", share=yield_text(line["all"])))
        _show_causes(_("causes of missing the conditions"), line["causes"])
        if line["worst"]:
            names = list(line["worst"][0]["results"])
            columns = [(_("drive"), True), (_("case"), True), *_x_column(found), (_("margin"), True)]
            columns += [(name, True) for name in names]
            rows = [
                (one["drive"], one["case"], *([one["x"]] if "x" in one else []), _percent(one["margin"]),
                 *one["results"].values())
                for one in line["worst"]
            ]  # fmt: skip
            show_table(_("worst drives"), columns, rows)


def yield_text(share: dict[str, Any]) -> str:
    """A yield in words."""
    if share["value"] is None:
        return _("no drive is run yet")
    low, high = _percent(share["low"]), _percent(share["high"])
    value = _percent(share["value"])
    return _("{value} ({low} to {high}) of {drives} drives", value=value, low=low, high=high, drives=share["drives"])


def _x_column(found: dict[str, Any]) -> list[tuple[str, bool]]:
    return [(heading(found["x"]["path"], found["x"]["unit"]), True)] if found["x"] else []


def _show_causes(title: str, causes: dict[str, Any]) -> None:
    known = [item for item in causes["shares"] if item["share"] is not None]
    known.sort(key=lambda item: -item["share"])
    if known:
        rows = [(item["tolerance"], _percent(max(item["share"], 0.0)), _percent(item["error"])) for item in known]
        show_table(title, [(_("tolerance"), False), (_("share"), True), ("+-", True)], rows)
    if causes["note"]:
        say(_("note: {text}", text=_(causes["note"])))


def _percent(share: float | None) -> str:
    return "" if share is None else f"{cell_text(round(100.0 * share, 1))} %"
