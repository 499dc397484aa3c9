"""The page on which somebody chooses the units and names in which all pages are read."""

from __future__ import annotations

from collections.abc import Mapping

from starlette.responses import RedirectResponse, Response

from sprag.service.http.reading import PageChoice, keep
from sprag.service.http.routers import page_router
from sprag.service.http.web.form.values import Form
from sprag.service.http.web.templates import page
from sprag.service.http.web.way_in import within
from sprag.service.languages import N_
from sprag.service.reading.quantities import KINDS, SI, TYPED, read_units
from sprag.service.reading.reader import CAPTIONS, CODES, Choice

router = page_router()

NAMES = {CAPTIONS: N_("Captions for people"), CODES: N_("Code names, as in specs and files")}


@router.get("/units")
def units_page(choice: PageChoice, back: str = "") -> Response:
    """The units of each kind of quantity."""
    typed, chosen = read_units(choice.units)
    return page(
        "units.html",
        kinds=KINDS,
        rest=TYPED if typed else SI,
        chosen=chosen,
        names=NAMES,
        choice=choice,
        back=within(back),
    )


@router.post("/units")
async def choose_units(values: Form) -> Response:
    """Keep the choice in a cookie, and go back to the page that it was made on."""
    choice = Choice(_text(values), values.get("names", CAPTIONS))
    read_units(choice.units)
    response = RedirectResponse(within(values.get("back", "/")), status_code=303)
    keep(response, choice)
    return response


def _text(given: Mapping[str, str]) -> str:
    """The choice as `read_units` takes it."""
    rest = SI if given.get("rest") == SI else TYPED
    return ",".join([rest, *(f"{kind.name}={given[kind.name]}" for kind in KINDS if given.get(kind.name))])
