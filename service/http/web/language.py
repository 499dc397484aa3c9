"""The choice of the language in which pages are read; every page has a button for each other language."""

from __future__ import annotations

from starlette.responses import RedirectResponse, Response

from sprag.service import languages
from sprag.service.faults import choice_of
from sprag.service.http.language import PARAMETER, keep_language
from sprag.service.http.routers import page_router
from sprag.service.http.web.form.values import Form
from sprag.service.http.web.way_in import within

router = page_router()


@router.post("/language")
async def choose_language(values: Form) -> Response:
    """Keep the language in a cookie, and go back to the page that it was chosen on."""
    code = choice_of(PARAMETER, values.get(PARAMETER, ""), dict.fromkeys(languages.available()))
    response = RedirectResponse(within(values.get("back", "/")), status_code=303)
    keep_language(response, code)
    return response
