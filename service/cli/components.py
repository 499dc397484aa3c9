"""``sprag component``: the office's own springs, clutches and motors."""

from __future__ import annotations

from typing import Annotated, Any, cast

import typer

from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import say, show_table, table_words, write_json
from sprag_study.service.cli.files import decode, read_bytes, read_spec, write_pieces
from sprag_study.service.cli.groups import Groups
from sprag_study.service.cli.options import OutputFile
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import _
from sprag_study.worker.limits import MAX_BODY_BYTES

app = typer.Typer(help="The office's own springs, clutches and motors.", no_args_is_help=True, cls=Groups)

Kind = Annotated[str | None, typer.Option("--kind", metavar="KIND", help="Only spring, clutch or motor.")]


@app.command("list")
def list_components(
    kind: Kind = None,
    file: OutputFile = None,
) -> None:
    """List the components, or write them as a CSV file that `put` reads."""
    with connection() as client:
        if file is not None:
            query = [("format", "csv"), *([] if kind is None else [("kind", kind)])]
            with client.pieces("/components", query) as pieces:
                write_pieces(file, pieces)
            return
        found = client.request("GET", "/components", params={} if kind is None else {"kind": kind})
    if wants_json():
        write_json(found)
        return
    with table_words():
        heads = (_("id"), _("kind"), _("name"), _("fields"), _("note"))
        columns = [(head, False, place == 0) for place, head in enumerate(heads)]
        rows = []
        for one in found["components"]:
            fields = ", ".join(f"{name} {text}" for name, text in _read(one).items())
            rows.append((one["id"], one["kind"], one["name"], fields, one["note"]))
        show_table("", columns, rows)


def _read(component: dict[str, Any]) -> dict[str, str]:
    """The fields with their units, as pages show them; as they were typed where the models are not installed."""
    try:
        from sprag_study.service.reading.quantities import TYPED
        from sprag_study.service.spec.components import Component
        from sprag_study.service.views.components import shown_fields
    except ModuleNotFoundError:
        return dict(component["fields"])
    return shown_fields(Component(*(component[name] for name in ("kind", "name", "note", "fields"))), TYPED)


@app.command()
def put(
    file: Annotated[str, typer.Argument(metavar="FILE", help="CSV file, or JSON as the interface takes it.")],
) -> None:
    """Add the components of a file, all or none; those of the same kind and name are replaced."""
    text = decode(file, read_bytes(file, MAX_BODY_BYTES))
    body = cast("dict[str, Any]", read_spec(file)) if file.lower().endswith(".json") else {"csv": text}
    with connection() as client:
        made = client.request("POST", "/components", json=body)
    if wants_json():
        write_json(made)
    else:
        say(_("{count} components are in the catalogue", count=len(made["components"])))


@app.command()
def delete(
    component_id: Annotated[str, typer.Argument(metavar="ID", help="Id of the component.")],
) -> None:
    """Remove a component; studies that took it keep its values."""
    with connection() as client:
        client.delete_component(component_id)
