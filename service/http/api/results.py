"""All rows of a study as files, and its report."""

from __future__ import annotations

import logging
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Final

from fastapi import Query
from starlette.responses import Response

from sprag_study.sentences import Sentence
from sprag_study.service import formats, languages, report
from sprag_study.service.faults import FaultError, choice_of, parameter_error
from sprag_study.service.http.api.document import CONTENT_RANGE, files, format_query, problems
from sprag_study.service.http.api.document import not_modified as documented_304
from sprag_study.service.http.api.drawn_format import language_query
from sprag_study.service.http.api.study_views import PROBLEMS
from sprag_study.service.http.asked import asking, one_of
from sprag_study.service.http.context import StudyId
from sprag_study.service.http.decimals import DECIMAL
from sprag_study.service.http.drawing import Drawing, attached, conditional, tag_of
from sprag_study.service.http.kept_files import asks_for_part, file_response
from sprag_study.service.http.reading import ReportChoice, TableUnits
from sprag_study.service.http.respond import JSON, choose_format, not_modified, tagged
from sprag_study.service.http.routers import api_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.work import CHECK_PROBLEMS, Attended, Work
from sprag_study.service.reading.quantities import SI
from sprag_study.service.views import row_files
from sprag_study.service.views.study_questions import ReportQuestion

if TYPE_CHECKING:
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.library import Library

_LOG = logging.getLogger("sprag.service")
router = api_router("results", "/studies/{study_id:study}")

#: JSON is what is sent to who asks for nothing.
_ROW_FORMATS: Final[dict[formats.Format, str]] = {"json": JSON, **formats.MEDIA_TYPES}
#: Files of rows that can be in other units than SI.
_IN_UNITS: Final = ("csv", "parquet", "arrow", "xlsx")

_REPORT_POLICY = "default-src 'none'; img-src data:; style-src 'unsafe-inline'; sandbox allow-modals"

#: Cases of an ended study whose file is written before its first byte is sent, so that its length is known; of a larger
#: one only where a part or the length is asked for.
_AT_ONCE: Final = 100_000


@router.get(
    "/results",
    dependencies=[DECIMAL],
    response_class=Response,
    responses={
        **files("All finished cases, in the requested format.", formats.MEDIA_TYPES.values()),
        206: {"description": "The part of the file that `Range` asks for; of ended studies.", "headers": CONTENT_RANGE},
        **problems(
            "invalid-parameter",
            "invalid-selection",
            "study-not-found",
            "not-acceptable",
            "range-not-satisfiable",
            "storage-full",
            *CHECK_PROBLEMS,
        ),
        **documented_304(),
    },
)
async def get_results(
    work: Attended,
    study_id: StudyId,
    units: TableUnits = None,
    header: Annotated[
        str | None,
        Query(
            max_length=20,
            description="heads of CSV: `names`, with the unit where it is not SI, or `units`, with every unit",
            examples=["units"],
            json_schema_extra=one_of(formats.HEADERS),
        ),
    ] = None,
    form: Annotated[str | None, format_query(formats.FORMATS, "csv")] = None,
) -> Response:
    """Every finished case with all its results, in order of the cases: as a table, a labelled grid, or JSON."""
    chosen = choose_format(work.request, form, _ROW_FORMATS)
    if units and chosen not in _IN_UNITS:
        message, allowed = (
            Sentence("{form} files are in SI", form=chosen),
            Sentence("in {unit}", unit=", ".join(_IN_UNITS)),
        )
        raise parameter_error("units", "not-used", message, units, allowed)
    if header and chosen != "csv":
        raise parameter_error("header", "not-used", "only CSV has it", header, "in csv")
    heads: formats.Header = choice_of("header", "names" if header is None else header, formats.HEADERS)

    def look() -> tuple[StudyRecord, str]:
        record = work.context.store.studies.get(study_id)
        return record, tag_of(work.request, record.id, record.revision, chosen)

    record, tag = await in_thread(look)
    asked = work.context.library, study_id, chosen, units or SI, heads
    return not_modified(work.request, tag) or tagged(await _rows(work, record, tag, asked), tag)


async def _rows(
    work: Work,
    record: StudyRecord,
    tag: str,
    asked: tuple[Library, str, formats.Format, str, formats.Header],
) -> Response:
    """All rows as a file of an ended study, which is kept and has parts, or sent while they are read."""
    chosen = asked[2]
    name, media_type = f"{record.id}.{formats.SUFFIXES[chosen][0]}", formats.MEDIA_TYPES[chosen]
    if record.state.terminal and (record.cases <= _AT_ONCE or asks_for_part(work.request)):
        try:
            file = await work.kept_file(tag, row_files.write, *asked)
        except (OSError, FaultError) as error:  # the rows can be sent all the same
            if isinstance(error, FaultError) and error.code != "storage-full":
                raise
            _LOG.warning("A file of results cannot be kept: %s", error)
        else:
            return file_response(work.request, file, tag, media_type, {**attached(name), "Vary": "Accept"})
    return await work.rows(media_type, name, row_files.pieces, *asked)


async def get_report(
    *,
    work: Attended,
    study_id: StudyId,
    choice: ReportChoice,
    question: ReportQuestion,
    language: Annotated[str, language_query("the document")] = languages.ENGLISH,
    form: Annotated[str | None, format_query(report.REPORT_FORMATS, "pdf")] = None,
) -> Response:
    """A study as a printable page or a PDF of two pages: answer, machine, curves, conditions, how far to trust them.

    Chapters of `appendix` follow. Without `x`, `y`, `by`, `at` and `of` the curves are those that the page of the study
    shows first. Figures that were put into the report are drawn in their place unless there is `y`.
    """
    chosen = choose_format(work.request, form, report.MEDIA_TYPES)
    office, library = report.Office.of(work.context.settings), work.context.library

    def make(_record: StudyRecord) -> Drawing:
        policy = {"Content-Security-Policy": _REPORT_POLICY} if chosen == "html" else {}
        asked = library, study_id, choice, dated, office, chosen
        return Drawing(report.report_file, asked, report.MEDIA_TYPES[chosen], policy)

    choice_of("language", language, languages.available())
    with languages.language(language):
        dated = replace(question, date=office.today() if question.date is None else question.date)
        return await conditional(work, study_id, f"{chosen} {dated.date}", make)


router.get(
    "/report",
    response_class=Response,
    responses={
        **files("The study as a printable document.", report.MEDIA_TYPES.values()),
        **problems(*PROBLEMS),
        **documented_304(),
    },
)(asking(get_report, ReportQuestion))
