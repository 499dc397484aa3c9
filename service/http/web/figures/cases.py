"""The figures of the views of a case: an address for each of `sprag.service.views.cases` that is a picture."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

from starlette.responses import Response

from sprag.service.figures.read import read_figure
from sprag.service.http.asked import asking
from sprag.service.http.context import CaseNumber, StartNumber, StudyId
from sprag.service.http.drawing import Columns, unchanging
from sprag.service.http.reading import FileChoice
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.plotly import Data, plotly_figure
from sprag.service.http.work import Attended
from sprag.service.views.case_view import see
from sprag.service.views.cases import CASE_VIEWS
from sprag.service.views.library import reading_of

if TYPE_CHECKING:
    from sprag.service.reading.reader import Reading
    from sprag.service.views.case_view import CaseView
    from sprag.worker.study import Study

router = page_router()


def case_figure(
    study: Study,
    case: int,
    view: CaseView[Any, Any, Any],
    chosen: Any,
    start: int | None,
    columns: int,
    rows: Any,
    reading: Reading,
) -> Data:
    """Compute the view of a case and draw it for the browser. For a process that computes."""
    figure = view.figure(see(study, case, view, chosen, start), columns, rows)
    return plotly_figure(read_figure(figure, reading))


def _add(view: CaseView[Any, Any, Any]) -> None:
    async def drawn(
        *, work: Attended, study_id: StudyId, case: CaseNumber, choice: FileChoice, question: Any,
        columns: Columns = 2, which: StartNumber = None,
    ) -> Response:  # fmt: skip
        study, asked = await work.case_of(study_id, case, partial(view.choose, case=case, question=question), which)
        rows = await in_thread(view.rows, work.context.store, study_id, study, case, asked)

        async def make() -> Response:
            for kernel in view.kernels(study):
                await work.load(kernel)
            reading = await in_thread(reading_of, work.context.store, study_id, choice)
            shown = study, case, view, asked, which, columns, rows, reading
            return json_response(await work.compute(case_figure, *shown))

        return await (make() if rows is not None else unchanging(work, study_id, make))

    path = f"/studies/{{study_id:study}}/cases/{{case:case}}/{view.about.name}/figure"
    router.get(path)(asking(drawn, view.about.question, () if view.about.starts else ("which",)))


for _view in CASE_VIEWS.values():
    if _view.about.pictures:
        _add(_view)
