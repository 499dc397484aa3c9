"""The document of a study as a page: the sheets that its files have, with fields for what its author writes."""

from __future__ import annotations

import asyncio
from contextlib import suppress
from contextvars import copy_context
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from starlette.responses import RedirectResponse, Response, StreamingResponse

from sprag_study.service.faults import FaultError
from sprag_study.service.http import views
from sprag_study.service.http.asked import asking
from sprag_study.service.http.context import Ctx, StudyId
from sprag_study.service.http.current import current
from sprag_study.service.http.reading import page_query
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.saved_views import saved_here, view_actions
from sprag_study.service.http.web.templates import fragment
from sprag_study.service.http.work import Attended
from sprag_study.service.languages import _, pgettext
from sprag_study.service.report import Office
from sprag_study.service.report.document import LONGEST_TEXT, Shown, shown_document
from sprag_study.service.report.html import embedded
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.study_questions import ReportQuestion

if TYPE_CHECKING:
    from collections.abc import AsyncIterator, Awaitable, Callable

    from sprag_study.service.faults import Fault
    from sprag_study.service.http.context import Context

    Render = Callable[[Shown | None, tuple[Fault, ...]], str]

router = page_router()

#: Seconds after which the page begins before its document is made.
_SOON: Final = 1.0
#: Where the document stands in the page.
_HERE: Final = "<!-- document -->"
#: Settings of the question that are fields in the sheets, or of the form beside them.
_FIELDS: Final = ("customer", "quote", "number", "author", "date", "revision", "project", "text", "appendix", "point")


async def document_page(*, context: Ctx, work: Attended, study_id: StudyId, question: ReportQuestion) -> Response:
    """The document of a study; where it takes long to make, the page says so and goes on when it is made."""
    given = work.request.query_params.multi_items()
    office = Office.of(context.settings)
    kept = _kept(given, office.today())
    if kept != given:
        query = urlencode(kept)
        return RedirectResponse(f"/studies/{study_id}/document{'?' if query else ''}{query}", status_code=303)
    shell = await in_thread(_shell, context, study_id)
    begin, end = shell.split(_HERE)

    def make(asked: ReportQuestion) -> Awaitable[Shown]:
        return work.check(shown_document, context.library, study_id, current().choice, asked, office)

    making = asyncio.ensure_future(make(question))
    without_point = partial(make, replace(question, point=None)) if question.point else None
    here = copy_context()

    def render(shown: Shown | None, faults: tuple[Fault, ...]) -> str:
        return here.run(_document, context, study_id, question, kept, shown, faults)

    await asyncio.wait([making], timeout=_SOON)
    if making.done():
        text, status = await _made(making, without_point, render)
        return Response(begin + text + end, status_code=status, media_type="text/html")

    async def pieces() -> AsyncIterator[str]:
        try:
            yield begin + str(fragment("_making.html"))
            text, _status = await _made(making, without_point, render)
            yield text + end
        finally:
            making.cancel()
            with suppress(asyncio.CancelledError, Exception):
                await making

    return StreamingResponse(pieces(), media_type="text/html")


router.get("/studies/{study_id:study}/document")(asking(document_page, ReportQuestion))


def _kept(given: list[tuple[str, str]], today: str) -> list[tuple[str, str]]:
    """The parameters of an address that say something: fields are sent empty too, but only of a date that means none.

    Of the texts of the author the empty ones before another one count, because they have places.
    """
    last = max((place for place, (name, value) in enumerate(given) if name == "text" and value.strip()), default=-1)
    return [
        (name, value)
        for place, (name, value) in enumerate(given)
        if (place <= last if name == "text" else value != today if name == "date" else value or name not in _FIELDS)
    ]


async def _made(
    making: asyncio.Future[Shown], without_point: Callable[[], Awaitable[Shown]] | None, render: Render
) -> tuple[str, int]:
    """The rest of the page, and the status that it would have.

    Where the working point is refused, the document ``without_point`` is shown, with what its author has written.
    """
    shown = None
    faults: tuple[Fault, ...] = ()
    try:
        shown = await making
    except FaultError as error:
        if not error.faults:
            raise
        faults = tuple(error.faults)
        if without_point is not None:
            with suppress(FaultError):
                shown = await without_point()
    return await in_thread(render, shown, faults), 422 if faults else 200


def _shell(context: Context, study_id: str) -> str:
    """The page without its document."""
    return str(fragment("document.html", study=context.store.studies.get(study_id), here_is=_HERE))


def _document(
    context: Context,
    study_id: str,
    question: ReportQuestion,
    kept: list[tuple[str, str]],
    shown: Shown | None,
    faults: tuple[Fault, ...],
) -> str:
    """The form of the document and its sheets."""
    found, logo = context.store.views.all(study_id), Office.of(context.settings).logo
    name = question.number or _("Report")
    text = fragment(
        "_document_page.html",
        study_id=study_id,
        shown=shown,
        faults=faults,
        reading=reading_of(context.store, study_id, current().choice),
        field_names={"point": _("Working point")},
        question=question,
        fields={
            _("Customer"): "customer",
            _("Quote"): "quote",
            pgettext("of a document", "Number"): "number",
            _("Author"): "author",
            _("Date"): "date",
            _("Revision"): "revision",
        },
        others=[(key, value) for key, value in kept if key not in (*_FIELDS, "language")],
        file=f"{views.study_address(study_id)}/report",
        logo=None if logo is None else embedded(logo[1], logo[0]),
        longest=LONGEST_TEXT,
        figures=[saved for saved in found if saved.place is not None],
        here_saved=saved_here(found, "document", study_id, page_query(), name),
        view_actions=view_actions(),
        choice=current().choice,
    )
    return str(text)
