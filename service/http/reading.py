"""How somebody wants to read: units, names and time zone, in the address, otherwise in a cookie of the browser."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Final
from urllib.parse import quote, unquote, urlencode, urlsplit

from fastapi import Depends, Query, Request

from sprag_study.service.faults import SelectionError
from sprag_study.service.http.context import Ctx
from sprag_study.service.http.current import current, learn
from sprag_study.service.http.language import language_pairs
from sprag_study.service.reading.quantities import SI, UNITS_PATTERN, read_units
from sprag_study.service.reading.reader import CAPTIONS, CODES, Choice
from sprag_study.service.zones import is_zone

if TYPE_CHECKING:
    from starlette.responses import Response

UNITS_COOKIE: Final = "sprag_units"
NAMES_COOKIE: Final = "sprag_names"
#: The time zone that somebody chose, and that in which the browser is (static/reader.js).
ZONE_COOKIE: Final = "sprag_zone"
HERE_COOKIE: Final = "sprag_here"
#: The zone of an office that has set none.
UTC: Final = "UTC"
_YEAR: Final = 365 * 24 * 3600


async def page_choice(request: Request, context: Ctx) -> Choice:
    """The choice of a page: that of its address, of the browser, or of the service. Raises SelectionError."""
    context.visited.set()
    usual, office = context.settings.units, context.settings.zone
    given, kept = request.query_params, request.cookies
    units, names = given.get("units"), given.get("names")
    if units is None:
        units = _valid(unquote(kept.get(UNITS_COOKIE, "")))
    if names is None:
        names = CODES if kept.get(NAMES_COOKIE) == CODES else CAPTIONS
    read_units(units)
    choice = Choice(units or usual, names or CAPTIONS)
    chosen, here = (_zone(unquote(kept.get(name, ""))) for name in (ZONE_COOKIE, HERE_COOKIE))
    zone = chosen or here or office
    learn(choice=choice, usual=usual, zone=zone, zone_known=bool(chosen or here) or office != UTC, chosen_zone=chosen)
    if request.method == "GET":  # the address of a page that answers a form may have no page of its own
        # What the address says would hide what is chosen next.
        own = request.url.remove_query_params(["units", "names", "language"])
        learn(page=str(own.replace(scheme="", netloc="")))
    return choice


def _zone(name: str) -> str:
    return name if name and is_zone(name) else ""


def _valid(units: str) -> str:
    """Kept units; "" for those that are no longer known."""
    try:
        read_units(units)
    except SelectionError:
        return ""
    return units


TableUnits = Annotated[
    str | None,
    Query(
        max_length=400,
        description="units of tables and pictures: `si`, `workshop` (rpm, mm, deg, %), `typed` (those of the spec), or "
        "a list such as `rpm,mm,torque=N*mm`, with one of these words in it for the rest; JSON is always in SI",
        examples=["rpm,mm"],
        json_schema_extra={"pattern": UNITS_PATTERN},
    ),
]


async def file_choice(
    units: TableUnits = None,
    names: Annotated[
        str | None,
        Query(
            max_length=20,
            description="names in pictures: `captions` for people, or `codes`",
            examples=["codes"],
            json_schema_extra={"pattern": f"^({CAPTIONS}|{CODES})$"},
        ),
    ] = None,
) -> Choice:
    """The choice of a file or a figure, whose address has all of it: SI and captions unless it says otherwise."""
    read_units(units or SI)
    return Choice(units or SI, CAPTIONS if names is None else names)


async def report_choice(
    context: Ctx, choice: Annotated[Choice, Depends(file_choice)], units: TableUnits = None
) -> Choice:
    """The choice of a document for people: that of the service unless its address says otherwise."""
    return replace(choice, units=units or context.settings.units)


PageChoice = Annotated[Choice, Depends(page_choice)]
ReportChoice = Annotated[Choice, Depends(report_choice)]
FileChoice = Annotated[Choice, Depends(file_choice)]


def address_pairs(choice: Choice) -> list[tuple[str, str]]:
    """The choice as parameters of the addresses of figures and files."""
    return [("units", choice.units), *([("names", choice.names)] if choice.names != CAPTIONS else [])]


def file_pairs() -> list[tuple[str, str]]:
    """The choice of the page that is made, and its language, as parameters of the addresses of its files."""
    return [*address_pairs(current().choice), *language_pairs()]


def file_read_as() -> str:
    """`file_pairs` as the rest of an address of a file that has a query already."""
    return f"&{urlencode(file_pairs())}"


def page_query() -> str:
    """The query of the address of the page that is made, with the choice of how it is read."""
    own = urlsplit(current().page).query
    return "&".join(filter(None, (own, urlencode(address_pairs(current().choice)) if own else "")))


def keep(response: Response, choice: Choice) -> None:
    """Keep the choice in the browser."""
    for name, value in ((UNITS_COOKIE, quote(choice.units)), (NAMES_COOKIE, choice.names)):
        response.set_cookie(name, value, max_age=_YEAR, httponly=True, samesite="lax")


def keep_zone(response: Response, zone: str) -> None:
    """Keep a chosen time zone in the browser; "" for that of the browser."""
    if zone:
        response.set_cookie(ZONE_COOKIE, quote(zone), max_age=_YEAR, httponly=True, samesite="lax")
    else:
        response.delete_cookie(ZONE_COOKIE, httponly=True, samesite="lax")
