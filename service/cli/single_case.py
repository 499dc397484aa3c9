"""``sprag case``: one case of a study of a running service, and its motions, which the service computes again."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated, Any, Final

import typer

from sprag_study.service.cli.console import say, show_table, write_json, wrong_option
from sprag_study.service.cli.file_formats import PICTURES, file_format
from sprag_study.service.cli.files import to_file, write_pieces
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import DEFAULT_SERVER, JsonFlag, OutputFile, Server, StudyId, Token
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import N_, _
from sprag_study.service.views.case_questions import CASE_VIEWS

#: What a service computes of one case.
Part = StrEnum("Part", {about.name.upper(): about.name for about in CASE_VIEWS})  # type: ignore[misc]
_FORMATS: Final = ("csv", "json", *PICTURES)


def case(
    study_id: StudyId,
    number: Annotated[int, typer.Argument(metavar="N", min=0, help="Number of the case, from 0.")],
    part: Annotated[
        Part | None, typer.Argument(help="A motion of the case; default: its parameters and results.")
    ] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set", metavar="NAME=VALUE", help="Setting of the motion, such as points=500 or along=shaft.load."
        ),
    ] = None,
    file: OutputFile = None,
    server: Server = DEFAULT_SERVER,
    token: Token = None,
    as_json: JsonFlag = False,
) -> None:
    """Show one case of a study, or write a motion of it: as CSV, JSON, or by the name of FILE as a picture.

    The settings of a motion are the parameters of its address in the HTTP interface.
    """
    from sprag_study.service.client.wire import case_path

    query = [_setting(text) for text in settings or ()]
    if part is None:
        if query or file is not None:
            name = "--set" if query else "--output"
            raise wrong_option(name, "not-used", N_("belongs to a motion, and none is named"), allowed=", ".join(Part))
        with connection(server, token) as client:
            found = client.request("GET", case_path(study_of(client, study_id), number, ""))
        _show(found, as_json)
        return
    named = file is not None and to_file(file)
    form = file_format(file, _FORMATS) if named and file is not None else "json" if as_json else "csv"
    with connection(server, token) as client:
        path = case_path(study_of(client, study_id), number, f"/{part.value}")
        with client.pieces(path, [*query, ("format", form)]) as pieces:
            written = write_pieces(file, pieces)
    if named:
        say(_("{file}: {size} bytes", file=file, size=written))


def _setting(text: str) -> tuple[str, str]:
    name, equals, value = text.partition("=")
    if not equals or not name.strip():
        raise wrong_option(
            "--set", "invalid-text", N_("is not a setting"), text, allowed=_("NAME=VALUE, such as points=500")
        )
    return name.strip(), value.strip()


def _show(found: dict[str, Any], as_json: bool) -> None:
    if as_json:
        write_json(found)
        return
    meaning = f"{found['ending']}. {_(found['ending_meaning'])}"
    say(_("case {case}: {text}", case=found["case"], text=meaning))
    say(*(f"{flag}: {_(meaning)}" for flag, meaning in found["flag_meanings"].items()))
    units = {name: "" if unit == "1" else unit for name, unit in found["units"].items()}
    for title, values in ((_("parameters"), found["parameters"]), (_("results"), found["results"])):
        rows = [(name, value, units.get(name, "")) for name, value in values.items()]
        show_table(title, ((_("name"), False), (_("value"), True), (_("unit"), False, True)), rows)
