"""``sprag view``: addresses of pages under a name, and the figures of a study's report."""

from __future__ import annotations

import re
from typing import Annotated, Any
from urllib.parse import urlsplit

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import say, show_table, table_words, write_json, wrong_option
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import N_, _

app = typer.Typer(help="Saved views of pages, and the figures of a study's report.", no_args_is_help=True, cls=Groups)

ViewId = Annotated[str, typer.Argument(metavar="ID", help="Id of the view.")]
_STUDY_PAGE = re.compile(r".*/studies/(?P<study>[^/]+)/(?P<page>[a-z]+)")


@app.command("list")
def list_views(
    study: Annotated[str | None, typer.Option("--study", metavar="ID", help="Only the views of this study.")] = None,
) -> None:
    """List saved views: figures of reports in order, then the others by name."""
    with connection() as client:
        found = client.request("GET", "/views", params={} if study is None else {"study": study})
    if wants_json():
        write_json(found)
        return
    with table_words():
        columns = ((_("id"), False, True), (_("figure"), True), (_("name"), False), (_("address"), False))
        rows = [(one["id"], "" if one["place"] is None else str(one["place"]), one["name"], one["address"])
                for one in found["views"]]  # fmt: skip
        show_table("", columns, rows)


@app.command()
def save(
    address: Annotated[str, typer.Argument(metavar="ADDRESS", help="Address of the page, as the browser shows it.")],
    name: Annotated[
        str, typer.Option("--name", metavar="NAME", help="Its name; a view of the page with it is replaced.")
    ],
    report: Annotated[
        bool, typer.Option("--report", help="Also make these curves or this map a figure of the study's report.")
    ] = False,
) -> None:
    """Save the address of a page under a name."""
    body = {**_place(address), "name": name, "in_report": report}
    with connection() as client:
        _show(client.request("POST", "/views", json=body))


@app.command()
def change(
    view_id: ViewId,
    name: Annotated[str | None, typer.Option("--name", metavar="NAME", help="Its new name.")] = None,
    report: Annotated[
        bool | None, typer.Option("--report/--no-report", help="Whether it is a figure of the study's report.")
    ] = None,
    place: Annotated[
        int | None, typer.Option("--place", metavar="N", help="Its place among the figures of the report, from 1.")
    ] = None,
) -> None:
    """Rename a view, or change whether and where it is in the report of its study."""
    from sprag_study.service.client.wire import view_path

    given = {"name": name, "in_report": report, "place": place}
    fields = {key: value for key, value in given.items() if value is not None}
    with connection() as client:
        _show(client.request("PATCH", view_path(view_id), json=fields))


@app.command()
def delete(view_id: ViewId) -> None:
    """Delete a saved view."""
    with connection() as client:
        client.delete_view(view_id)


def _place(address: str) -> dict[str, Any]:
    """Page, study and choices of an address; WrongInputError for one that has none."""
    try:
        parts = urlsplit(address)
    except ValueError:  # as of http://[
        parts = urlsplit("")
    path = parts.path.rstrip("/")
    if found := _STUDY_PAGE.fullmatch(path):
        return {**found.groupdict(), "query": parts.query}
    if path.endswith("/compare"):
        return {"page": "compare", "query": parts.query}
    if parts.query and "/studies/" not in path:
        return {"page": "studies", "query": parts.query}
    allowed = _("the address of a page with choices, such as /studies/ID/curves?x=shaft.load")
    raise wrong_option(
        "ADDRESS", "invalid-text", N_("is not an address of a page with views"), address, allowed=allowed
    )


def _show(saved: dict[str, Any]) -> None:
    if wants_json():
        write_json(saved)
        return
    named = f"{saved['id']}: {saved['name']}"
    say(
        named if saved["place"] is None else _("{view}, figure {place} of the report", view=named, place=saved["place"])
    )
