"""What is known of the request that is answered: one value for all that runs for it."""

from __future__ import annotations

from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from sprag_study.service.reading.quantities import WORKSHOP
from sprag_study.service.reading.reader import Choice

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.http.grants import Grant
    from sprag_study.service.storage.database.session import Moment


@dataclass(frozen=True, slots=True)
class Current:
    """What is known of a request.

    Attributes
    ----------
    grant : None outside a request, or where it is unknown
    prefix : of the addresses of the service that answers, "" for none
    changing : whether it changes something
    moment : when what it reads is read; None where each reading has its own moment
    choice : of units and names on a page
    page : address of the page that is made; "" for one that answers a form
    usual : the choice of the service, which a page has where nobody chose another
    zone : time zone of the reader of a page
    zone_known : whether somebody said so: the reader, the browser, or an office with another one than UTC
    chosen_zone : where somebody chose it, "" where the browser or the service has it
    """

    grant: Grant | None = None
    prefix: str = ""
    changing: bool = False
    moment: Moment | None = None
    choice: Choice = Choice(WORKSHOP)  # noqa: RUF009 - frozen
    page: str = ""
    usual: str = WORKSHOP
    zone: str = "UTC"
    zone_known: bool = False
    chosen_zone: str = ""


_CURRENT: ContextVar[Current] = ContextVar("current", default=Current())  # noqa: B039 - frozen


def current() -> Current:
    """What is known of the request that is answered."""
    return _CURRENT.get()


def learn(**known: Any) -> None:
    """Know more of the rest of the request."""
    _CURRENT.set(replace(current(), **known))


@contextmanager
def knowing(**known: Any) -> Iterator[None]:
    """Know more of a request inside."""
    token = _CURRENT.set(replace(current(), **known))
    try:
        yield
    finally:
        _CURRENT.reset(token)
