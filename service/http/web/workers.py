"""The page of the workers: which can be used, which are refused and why, how fast each host is."""

from __future__ import annotations

from starlette.responses import Response

from sprag.service.http.context import Ctx
from sprag.service.http.routers import page_router
from sprag.service.http.web.templates import page
from sprag.service.jobs.workers import worker_list

router = page_router()


@router.get("/workers")
def workers_page(context: Ctx) -> Response:
    """The dispatcher and its workers, as it last reported them."""
    return page("workers.html", found=worker_list(context.store.dispatchers))
