"""``sprag study extend``, ``longer`` and ``narrow``: further cases, more time and smaller steps."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import typer

from sprag_study.sentences import Name, WarningText
from sprag_study.service.cli import completion
from sprag_study.service.cli.console import say, warning_lines, wrong_option
from sprag_study.service.cli.files import decode, read_bytes
from sprag_study.service.cli.following import further, submitted
from sprag_study.service.cli.names import study_of
from sprag_study.service.cli.options import StudyId, Wait, WaitTimeout
from sprag_study.service.cli.remote import connection
from sprag_study.service.languages import N_, _, ngettext
from sprag_study.service.reading.numbers import assumption, could_be_one, in_language, parse_number, settle, settled
from sprag_study.service.reading.printed import could_be_values
from sprag_study.service.reading.together import with_last_unit
from sprag_study.worker.limits import (
    GENERATIONS,
    MAX_BODY_BYTES,
    MAX_NARROW_STEPS,
    MAX_SETTLED_PERIODS,
    MIN_NARROW_STEPS,
    MIN_SETTLED_PERIODS,
    NARROW_STEPS,
)


def extend(
    study_id: StudyId,
    axis: Annotated[
        list[str] | None,
        typer.Option(
            "--axis",
            metavar="PATH=VALUES",
            help="Further values, such as shaft.load=0.5,0.7; with decimal commas 0,5;0,7. May be repeated.",
        ),
    ] = None,
    points: Annotated[
        str | None, typer.Option("--points", metavar="FILE", help="CSV file of further cases, a header of paths.")
    ] = None,
    generations: Annotated[
        int | None,
        typer.Option(
            "--generations",
            min=GENERATIONS[0],
            max=GENERATIONS[1],
            help="Further generations of a search with a goal, beyond those that it came to.",
            show_default=False,
        ),
    ] = None,
    wait: Wait = False,
    timeout: WaitTimeout = None,
) -> None:
    """Submit a study with more values on the axes of an old one, more cases or more generations; only new cases run."""
    from sprag_study.service.client.wire import study_path

    addition = _addition(axis or [], points, generations)
    with connection() as client:
        study_id = study_of(client, study_id)
        old = client.request("GET", study_path(study_id))
        study = further(client, study_id, "extend", json=addition)
        say(
            _what_is_new(old, study) if generations is None else _("the designs of {study} are reused", study=old["id"])
        )
        submitted(client, study, wait, timeout)


def longer(
    study_id: StudyId,
    regime: Annotated[
        str | None,
        typer.Option(
            "--regime",
            metavar="REGIME",
            help="Regime of the cases of a settled study.",
            show_default="unsettled",
            autocompletion=completion.regimes,
        ),
    ] = None,
    at_most: Annotated[
        int | None,
        typer.Option(
            min=MIN_SETTLED_PERIODS,
            max=MAX_SETTLED_PERIODS,
            help="Excitation periods of each search or run; default: four times as many as before.",
        ),
    ] = None,
    wait: Wait = False,
    timeout: WaitTimeout = None,
) -> None:
    """Submit a study of the unsettled cases of another, with more time for each."""
    from sprag_study.service.client.queries import query_of

    with connection() as client:
        study = further(
            client, study_of(client, study_id), "longer", params=query_of({"regime": regime, "at_most": at_most})
        )
        submitted(client, study, wait, timeout)


def narrow(
    study_id: StudyId,
    steps: Annotated[
        int,
        typer.Option(
            min=MIN_NARROW_STEPS, max=MAX_NARROW_STEPS, help="Smaller steps into which each of these steps is split."
        ),
    ] = NARROW_STEPS,
    at: Annotated[
        list[str] | None,
        typer.Option("--at", metavar="PATH=VALUE", help="Only value of another axis; may be repeated. Default: all."),
    ] = None,
    wait: Wait = False,
    timeout: WaitTimeout = None,
) -> None:
    """Submit the sweep of a study again, with smaller steps where its motion jumps."""
    query = [("steps", str(steps)), *(("at", text) for text in at or [])]
    with connection() as client:
        study = further(client, study_of(client, study_id), "narrow", params=query)
        submitted(client, study, wait, timeout)


def _what_is_new(old: Mapping[str, Any], study: Mapping[str, Any]) -> str:
    """How many of the cases are new."""
    new = study["cases"] - old["cases"]
    if not new:
        return _("nothing is new: {study} has all of the {cases} cases", study=old["id"], cases=old["cases"])
    return ngettext(
        "{new} of the {cases} cases is new, the others are those of {study}",
        "{new} of the {cases} cases are new, the others are those of {study}",
        new,
        new=new,
        cases=study["cases"],
        study=old["id"],
    )


def _addition(axes: list[str], points: str | None, generations: int | None) -> dict[str, Any]:
    if [bool(axes), points is not None, generations is not None].count(True) != 1:
        message = N_("or --points or --generations is needed, and only one of them")
        raise wrong_option(
            "--axis", "exactly-one", message, allowed="--axis shaft.load=0.5,0.7", detail=_("missing option")
        )
    if generations is not None:
        return {"generations": generations}
    if points is not None:
        return {"cases": [{"points": decode(points, read_bytes(points, MAX_BODY_BYTES))}]}
    made = []
    for text in axes:
        path, sign, values = text.partition("=")
        if not sign or not path.strip() or not values.strip():
            raise wrong_option(
                "--axis", "invalid-text", N_("must be PATH=VALUES"), text, allowed=_("such as shaft.load=0.5,0.7")
            )
        made.append({"path": path.strip(), "values": _values(values, path.strip())})
    return {"axes": made}


def _values(text: str, path: str = "") -> list[float | str]:
    """The values of a list: semicolons separate them where there are any, otherwise commas.

    A unit at the end holds for the bare numbers before it. A point of a bare number that could separate thousands is
    decimal, which is said; the service warns of those with units.
    """
    if could_be_one(text):
        raise wrong_option(
            "--axis", "ambiguous-comma", N_("could be one value or two"), text,
            allowed=_("semicolons between values, or a decimal point"),
        )  # fmt: skip
    items = settled([in_language(item) for item in text.split(";")]) if ";" in text else text.split(",")
    if could_be_values([item.strip() for item in items]) is not None:
        raise wrong_option(
            "--axis", "invalid-text", N_("could be one value or several"), text,
            allowed=_("semicolons between values, or no blanks"),
        )  # fmt: skip
    values = [_value(item) for item in with_last_unit([item.strip() for item in items])]
    doubt = settle(items).doubt
    if doubt is not None and not isinstance(values[doubt], str):
        say(*warning_lines([WarningText(assumption(items[doubt]), "ambiguous-point").at(Name(path))]))
    return values


def _value(text: str) -> float | str:
    number = parse_number(text)
    return text if number is None else number
