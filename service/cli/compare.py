"""``sprag compare``: studies of a running service side by side."""

from __future__ import annotations

import json
from typing import Annotated

import typer

from sprag_study.service.answers.differing import MOST_COMPARED
from sprag_study.service.cli import completion
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import Column, say, show_table, write_json, wrong_option
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import CurveBy
from sprag_study.service.cli.remote import connection
from sprag_study.service.cli.shown import show_curves
from sprag_study.service.languages import N_, _


def compare(
    studies: Annotated[
        list[str],
        typer.Argument(
            metavar="ID...", help="Studies, named as for other commands.", autocompletion=completion.studies
        ),
    ],
    x: Annotated[
        str | None,
        typer.Option(
            "--x",
            metavar="PATH",
            help="Axis along the curves; default: that of the first study.",
            autocompletion=completion.parameters,
        ),
    ] = None,
    y: Annotated[
        list[str] | None,
        typer.Option(
            "--y",
            metavar="RESULT",
            help="Result; may be repeated; default: those of the first study.",
            autocompletion=completion.results,
        ),
    ] = None,
    by: CurveBy = None,
    at: Annotated[
        list[str] | None, typer.Option("--at", metavar="PATH=VALUE", help="Value at which another axis is held.")
    ] = None,
) -> None:
    """Compare studies: the inputs in which they differ, and the same curves of each."""
    from sprag_study.service.client import Study
    from sprag_study.service.client import compare as side_by_side

    if not 2 <= len(studies) <= MOST_COMPARED:
        raise wrong_option(
            "ID", "out-of-range", N_("wrong number of studies"), len(studies), allowed=f"2 .. {MOST_COMPARED}"
        )
    held = dict(pair(text) for text in at or ())
    with connection() as client:
        named = [Study(client, study_of(client, text)) for text in studies]
        found = side_by_side(named, x, y or (), by=by or (), at=held)
    if wants_json():
        curves = {name: curves.data for name, curves in zip(found.names, found.curves, strict=False)}
        write_json({"studies": list(found.names), "inputs": found.inputs, "curves": curves})
        return
    columns: list[Column] = [(_("input"), False, True), *((name, False) for name in found.names)]
    rows = [(pointer, *map(_text, values)) for pointer, values in found.inputs.items()]
    if rows:
        show_table(_("inputs that differ"), columns, rows)
    else:
        say(_("No inputs differ."))
    if not found.curves:
        say(_("These studies have no varying parameter in common, so there are no curves to compare."))
    for name, drawn in zip(found.names, found.curves, strict=False):
        show_curves(drawn.data, name)


def pair(text: str) -> tuple[str, str]:
    """Path and value of the option ``--at``."""
    path, equals, value = text.partition("=")
    if not equals:
        raise wrong_option("--at", "invalid-text", N_("is not a value of an axis"), text, allowed="PATH=VALUE")
    return path.strip(), value.strip()


def _text(value: object) -> str | None:
    return None if value is None else value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
