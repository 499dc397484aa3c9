"""``sprag compare``: studies side by side."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag_study.service.answers.differing import MOST_COMPARED
from sprag_study.service.cli import completion
from sprag_study.service.cli.case_views import before_run
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.console import (
    Column,
    piped,
    say,
    show_table,
    table_words,
    write_json,
    write_text,
    wrong_option,
)
from sprag_study.service.cli.options import CurveBy, KeptIn
from sprag_study.service.cli.remote import opened
from sprag_study.service.cli.shown import show_curves, write_curves
from sprag_study.service.cli.sources import is_study, refuse_local
from sprag_study.service.languages import N_, _
from sprag_study.service.views.setting import settings_of
from sprag_study.service.views.study_questions import CurvesQuestion

if TYPE_CHECKING:
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.worker.study import Study as Inputs


def compare(
    studies: Annotated[
        list[str],
        typer.Argument(
            metavar="SPEC|ID...", help="Studies, named as for other commands.", autocompletion=completion.studies
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
    db: KeptIn = None,
) -> None:
    """Compare studies: the inputs in which they differ, and the same curves of each. Specs are run here first."""
    from sprag_study.service.client import Study
    from sprag_study.service.client import compare as side_by_side
    from sprag_study.service.client.wire import study_path

    if not 2 <= len(studies) <= MOST_COMPARED:
        raise wrong_option(
            "ID", "out-of-range", N_("wrong number of studies"), len(studies), allowed=f"2 .. {MOST_COMPARED}"
        )
    if all(map(is_study, studies)):
        refuse_local(db=db)
    held = dict(pair(text) for text in at or ())
    asked = CurvesQuestion(x, y, *((by, at) if x else (None, None)), rest="usual")  # else those of the first x
    specs: list[Inputs] = []

    def check(parsed: ParsedSpec) -> None:
        _check(asked, held, parsed.study)
        specs.append(parsed.study)

    ready = [opened(text, db=None if is_study(text) else db, check=check) for text in studies]
    with ExitStack() as stack:
        entered = {place: stack.enter_context(ready[place]) for place, text in enumerate(studies) if is_study(text)}
        if specs and held:
            _require_axes(held, specs, [source.request("GET", study_path(name)) for source, name in entered.values()])
        entered |= {place: stack.enter_context(one) for place, one in enumerate(ready) if place not in entered}
        sources = [entered[place] for place in range(len(studies))]
        found = side_by_side([Study(*source) for source in sources], x, y or (), by=by or (), at=held)
    ids = [study_id for _, study_id in sources]
    names = list(found.names) if db is not None else _by_file(found.names, studies, ids)
    curves = [(name, drawn.data) for name, drawn in zip(names, found.curves, strict=False)]
    if wants_json():
        write_json({"studies": names, "inputs": found.inputs, "curves": dict(curves)})
        return
    _show(names, found.inputs, curves)


def _show(names: Sequence[str], inputs: Mapping[str, Sequence[object]], curves: Sequence[tuple[str, Any]]) -> None:
    """The inputs that differ, a column for each study, and the curves of each."""
    rows = [(pointer, *map(_text, values)) for pointer, values in inputs.items()]
    with table_words():
        columns: list[Column] = [(_("input"), False, True), *((name, False) for name in names)]
        if rows or piped():
            show_table(_("inputs that differ"), columns, rows)
        if piped() and curves:
            write_text("\n")
            write_curves(curves)
    if not rows:
        say(_("No inputs differ."))
    if not curves:
        say(_("These studies have no varying parameter in common, so there are no curves to compare."))
    if not piped():
        for name, drawn in curves:
            show_curves(drawn, name)


def _by_file(names: Sequence[str], studies: Sequence[str], ids: Sequence[str]) -> list[str]:
    """The names with the file of a spec for the id of its study, which is gone when the command ends."""
    shown = []
    for place, (name, text, study_id) in enumerate(zip(names, studies, ids, strict=True)):
        before = studies[:place].count(text)  # the same file twice
        said = f"{text}, {before + 1}" if before else text
        shown.append(name if is_study(text) else name.replace(study_id, said))
    return shown


def _check(asked: CurvesQuestion, held: Mapping[str, str], study: Inputs) -> None:
    """Refuse axes, values and results that the study of a spec has not before it is run; WrongInputError."""
    from sprag_study.service.results.selection import locate_axes, numeric_results
    from sprag_study.service.views.curves import CurvesView
    from sprag_study.worker.models import study_results

    own = {path: value for path, value in held.items() if study.axis_of(path) is not None}  # others may have the rest
    with before_run(study, settings_of(CurvesQuestion)):
        locate_axes(study, [*own.items()])
        numeric_results(study_results(study), "y", asked.y or ())
        if asked.x and study.axes:
            at = [f"{path}={value}" for path, value in own.items()]
            CurvesView().check(study, CurvesView().choose(study, replace(asked, at=at)))


def _require_axes(held: Mapping[str, str], specs: Sequence[Inputs], others: Sequence[dict[str, Any]]) -> None:
    """Refuse values of what varies in none of the studies, unless they are those that all cases have."""
    from sprag_study.service.results.selection import locate_axes

    vary = {path for detail in others for axis in detail["axes"] for path in axis["paths"]}
    for path, value in held.items():
        if path not in vary and all(study.axis_of(path) is None for study in specs):
            for study in specs:
                with before_run(study, settings_of(CurvesQuestion)):
                    locate_axes(study, [(path, value)])


def pair(text: str) -> tuple[str, str]:
    """Path and value of the option ``--at``."""
    path, equals, value = text.partition("=")
    if not equals:
        raise wrong_option("--at", "invalid-text", N_("is not a value of an axis"), text, allowed="PATH=VALUE")
    return path.strip(), value.strip()


def _text(value: object) -> str | None:
    return None if value is None else value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
