"""``sprag show SPEC|ID cases`` and ``case``: the finished cases of a study, chosen and sorted, and one of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Final

import typer

from sprag_study.service.cli import completion
from sprag_study.service.cli.case_views import before_run
from sprag_study.service.cli.common import wants_json
from sprag_study.service.cli.compare import pair
from sprag_study.service.cli.console import (
    WrongInputError,
    heading,
    in_unit,
    piped,
    say,
    show_table,
    table_words,
    unit_of,
    write_json,
)
from sprag_study.service.cli.described import option, parameter, query_of, signed
from sprag_study.service.cli.file_formats import require_table
from sprag_study.service.cli.options import OF_SPEC, SHARED, CaseOption, FileUnits, KeptIn, PointsFile, TableFiles
from sprag_study.service.cli.remote import opened, read_in
from sprag_study.service.cli.sources import SpecOrStudy
from sprag_study.service.faults import Fault
from sprag_study.service.languages import N_, _
from sprag_study.service.views.setting import settings_of
from sprag_study.service.views.study_questions import CasesQuestion, SelectionQuestion

if TYPE_CHECKING:
    from sprag_study.service.spec.document import ParsedSpec

#: Most cases of one request.
_PAGE = 500


_ASKED: Final = (
    *settings_of(SelectionQuestion),
    *(one for one in settings_of(CasesQuestion) if one.name == "at"),
)
_Results = Annotated[
    list[str] | None,
    typer.Option(
        "--result", metavar="RESULT", help="Result to show; may be repeated.", autocompletion=completion.results
    ),
]
_Limit = Annotated[int, typer.Option(min=1, max=100_000, help="Most cases to show.")]


def _cases(
    study: str, result: list[str] | None, limit: int, units: str | None, points_file: str | None,
    tables: list[str] | None, db: str | None, **asked: Any,
) -> None:  # fmt: skip
    from sprag_study.service.client.wire import case_path, study_path

    for text in asked["at"] or ():
        pair(text)
    require_table(units)
    with opened(
        study, points=points_file, tables=tables, db=db, units=units, check=partial(_check, asked, result or ())
    ) as (source, study_id):
        query = [*query_of(_ASKED, asked), ("page_size", str(min(limit, _PAGE)))]
        found, si = _first(source.pages(f"{study_path(study_id)}/cases", query), limit)
        if wants_json():
            write_json({"cases": found})
            return
        names = found[0] if found else source.request("GET", case_path(study_id, 0, ""))
        with read_in(source, study_id, units), table_words():
            _show(found, names, result or (), si)


cases: Final = signed(
    _cases,
    "List finished cases of a study, in order of their numbers or sorted over all of them.",
    [
        parameter("study", SpecOrStudy, ...), *(parameter(one.name, option(one), one.default) for one in _ASKED),
        parameter("result", _Results, None), parameter("limit", _Limit, 50),
        *(parameter(name, SHARED[name], None) for name in ("units", *OF_SPEC)),
    ],
)  # fmt: skip


def _check(asked: Mapping[str, Any], results: Sequence[str], parsed: ParsedSpec) -> None:
    """Refuse what the study of a spec has not before it is run; WrongInputError."""
    from sprag_study.service.views.case_pages import check, wanted
    from sprag_study.worker.models import study_results

    _require_results(results, [info.name for info in study_results(parsed.study)])
    with before_run(parsed.study, _ASKED):
        check(parsed.study, wanted(CasesQuestion(**asked)))


def _require_results(names: Sequence[str], known: Collection[str]) -> None:
    """Raise WrongInputError for names of no result."""
    allowed = ", ".join(known)
    unknown = [name for name in names if name not in known]
    faults = [Fault("--result", "unknown-name", N_("is not a result"), name, allowed) for name in unknown]
    if faults:
        raise WrongInputError("invalid-parameter", _("invalid option"), faults)


def case(
    study: SpecOrStudy,
    case: CaseOption = 0,
    units: FileUnits = None,
    points_file: PointsFile = None,
    tables: TableFiles = None,
    db: KeptIn = None,
) -> None:
    """Show one case: how it ended, its parameters and its results."""
    from sprag_study.service.client.wire import case_path

    require_table(units)
    with opened(study, points=points_file, tables=tables, db=db, units=units, case=case) as (source, study_id):
        shown = source.request("GET", case_path(study_id, case, ""))
        if wants_json():
            write_json(shown)
            return
        meaning = f"{shown['ending']}. {_(shown['ending_meaning'])}"
        say(_("case {case}: {text}", case=shown["case"], text=meaning))
        say(*(f"{flag}: {_(meaning)}" for flag, meaning in shown["flag_meanings"].items()))
        with read_in(source, study_id, units), table_words():
            _show_case(shown)


def _show_case(shown: Mapping[str, Any]) -> None:
    """Parameters and results in two tables; for programs in one."""
    parts = {_("parameters"): shown["parameters"], _("results"): shown["results"]}
    if piped():
        parts = {"": {**shown["parameters"], **shown["results"]}}
    columns = ((_("name"), False), (_("value"), True), (_("unit"), False, True))
    for title, values in parts.items():
        known = ((name, value, shown["units"].get(name, "1")) for name, value in values.items())
        show_table(title, columns, [(name, in_unit(value, si), unit_of(si)) for name, value, si in known])


def _first(pages: Iterable[dict[str, Any]], limit: int) -> tuple[list[dict[str, Any]], dict[str, str]]:
    """At most ``limit`` cases, and the units of their columns."""
    shown: list[dict[str, Any]] = []
    units: dict[str, str] = {}
    for page in pages:
        shown, units = [*shown, *page["cases"]], page.get("units", {})  # an older service has none
        if len(shown) >= limit:
            break
    return shown[:limit], units


def _show(
    shown: Sequence[dict[str, Any]], first: Mapping[str, Any], results: Sequence[str], units: Mapping[str, str]
) -> None:
    """A row for each case: its parameters, how it ended, its regime and flags, and the chosen results; as ``first``."""
    _require_results(results, first["results"])
    kinds = [name for name in ("regime", "regime.order") if name in first["results"] and name not in results]
    columns = [(_("case"), True), *((heading(path, units.get(path, "1")), True) for path in first["parameters"])]
    columns += [(_("ending"), False), (_("flags"), False)]
    columns += [(heading(name, units.get(name, "1")), name not in kinds[:1]) for name in (*kinds, *results)]
    rows = (
        (
            case["case"],
            *case["parameters"].values(),
            case["ending"],
            ", ".join(case["flags"]),
            *(case["results"][name] for name in (*kinds, *results)),
        )
        for case in shown
    )
    show_table("", columns, rows)
