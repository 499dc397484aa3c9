"""``sprag ribbon`` and ``sprag yield``: what the drives of a study with tolerances do."""

from __future__ import annotations

from typing import Annotated, Any

import typer

from sprag.service.cli import completion
from sprag.service.cli.console import cell_text, say, show_table
from sprag.service.cli.names import study_of
from sprag.service.cli.options import DEFAULT_SERVER, JsonFlag, PictureLanguage, Server, StudyId, Token, in_language
from sprag.service.cli.pictures import HeldAt, answer, heading, held_text
from sprag.service.cli.remote import connection
from sprag.service.languages import _

_FILE = typer.Option("-o", "--output", metavar="FILE", help="File to write: .svg, .png or .pdf, or .csv.")
_FORMATS = ("svg", "png", "pdf", "csv")
_X = typer.Option(
    "--x",
    metavar="PATH",
    help="Axis along the lines; default: that of the curves.",
    autocompletion=completion.parameters,
)
_BY = typer.Option(
    "--by",
    metavar="PATH",
    help="Axis with a line for each of its values; may be repeated.",
    autocompletion=completion.parameters,
)
_MAP = typer.Option("--map", help="Write a map over the axes of --x and --by instead of lines.")


def ribbon(
    study_id: StudyId,
    x: Annotated[str | None, _X] = None,
    y: Annotated[
        list[str] | None,
        typer.Option("--y", metavar="RESULT", help="Result; may be repeated.", autocompletion=completion.results),
    ] = None,
    by: Annotated[list[str] | None, _BY] = None,
    at: HeldAt = None,
    quantile: Annotated[
        list[str] | None,
        typer.Option("--quantile", metavar="P", help="Probability, such as 0.05 or 5%; may be repeated."),
    ] = None,
    file: Annotated[str | None, _FILE] = None,
    mapped: Annotated[bool, _MAP] = False,
    language: PictureLanguage = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show quantiles of results over the drives of a study with tolerances, with their intervals and causes."""
    query = [*_places(x, by, at), *(("y", name) for name in y or ())]
    query += [("quantile", _probability(text)) for text in quantile or ()]
    drawing = [*([("map", "true")] if mapped else []), *in_language(language)]
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        answer(client, study_id, "ribbon", query, file, show_ribbon, as_json, _FORMATS, drawing)


def yields(
    study_id: StudyId,
    condition: Annotated[
        list[str],
        typer.Argument(metavar="CONDITION...", help='Such as "shaft.speed.mean >= 90 % of nominal"; all must hold.'),
    ],
    x: Annotated[str | None, _X] = None,
    by: Annotated[list[str] | None, _BY] = None,
    at: HeldAt = None,
    worst: Annotated[int, typer.Option("--worst", min=0, metavar="N", help="Number of the worst drives to list.")] = 5,
    file: Annotated[str | None, _FILE] = None,
    mapped: Annotated[bool, _MAP] = False,
    language: PictureLanguage = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show the share of drives that reach conditions, the tolerances that it is owed to, and the worst drives."""
    query = [*_places(x, by, at), *(("condition", text) for text in condition), ("worst", str(worst))]
    drawing = [*([("map", "true")] if mapped else []), *in_language(language)]
    with connection(server, token) as client:
        study_id = study_of(client, study_id)
        answer(client, study_id, "yield", query, file, show_yield, as_json, _FORMATS, drawing)


def _places(x: str | None, by: list[str] | None, at: list[str] | None) -> list[tuple[str, str]]:
    given = [] if x is None else [("x", x)]
    return [*given, *(("by", path) for path in by or ()), *(("at", item) for item in at or ())]


def _probability(text: str) -> str:
    """The probability of ``5%`` or ``0.05``; what is neither is left to the service to refuse."""
    number, percent, _ = text.partition("%")
    try:
        return repr(float(number) / 100.0) if percent else text
    except ValueError:
        return text


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
