"""``sprag models``: what a running service computes."""

from __future__ import annotations

from typing import Annotated

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import show_table, table_words, write_json
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import _


def models(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="MODEL",
            help="Model whose parameters and results to list.",
            autocompletion=completion.models,
        ),
    ] = None,
) -> None:
    """List the models of a service, or the parameters and results of one."""
    from sprag_study.service.client.wire import model_path

    with connection() as client:
        found = client.request("GET", "/models" if name is None else model_path(name))
    if wants_json():
        write_json(found)
    elif name is None:
        with table_words():
            columns = ((_("model"), False, True), (_("parameters"), True), (_("results"), True), (_("engine"), False))
            rows = [(m["name"], len(m["parameters"]), len(m["results"]), m["engine_version"]) for m in found["models"]]
            show_table("", columns, rows)
    else:
        with table_words():
            parameters = [(p["path"], p["unit"], p["range"], _(p["help"])) for p in found["parameters"]]
            columns = ((_("path"), False, True), (_("unit"), False), (_("range"), False), ("", False))
            show_table(_("parameters"), columns, parameters)
            results = [(r["name"], r["unit"], _(r["description"])) for r in found["results"]]
            show_table(_("results"), ((_("name"), False, True), (_("unit"), False), ("", False)), results)
