"""Saved views: the address of a page under a name. One of curves or of a map can be a figure of the study's report."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import parse_qsl, urlencode

from sprag.sentences import Sentence
from sprag.service.reading.limits import characters, printable_line, span
from sprag.service.spec.fields import read_flag, read_object
from sprag.service.spec.report import Report
from sprag.worker.limits import MAX_NAME_LENGTH, MAX_REPORT_FIGURES, MAX_VIEW_QUERY

if TYPE_CHECKING:
    from collections.abc import Mapping

#: Pages whose views can be figures of the report.
FIGURES: Final = ("curves", "map")
#: Pages of a study, and those of the whole service.
STUDY_PAGES: Final = (*FIGURES, "explore", "front", "drives", "sensitivity", "cases")
OWN_PAGES: Final = ("studies", "compare")
PAGES: Final = (*STUDY_PAGES, *OWN_PAGES)
#: Parameters of addresses that say what was done before, or where a list goes on.
_PASSING: Final = frozenset({"done", "changed", "after"})
_STUDY: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
_NAME: Final[dict[str, Any]] = {"type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH}
_QUERY: Final[dict[str, Any]] = {
    "type": "string",
    "maxLength": MAX_VIEW_QUERY,
    "description": "the choices as the query of the page's address, without `?`",
}
_IN_REPORT: Final = {"type": "boolean", "description": "whether it is a figure of the study's report"}

#: JSON Schemas of a view to be saved and of a change.
SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "A view to save; one of the same study, page and name is replaced.",
    "required": ["page", "name"],
    "additionalProperties": False,
    "properties": {
        "page": {"enum": list(PAGES)},
        "study": {
            "type": ["string", "null"],
            "pattern": f"^{_STUDY.pattern}$",
            "description": "the study of the page; null for `studies` and `compare`",
        },
        "name": {**_NAME, "description": "its name, one line"},
        "query": _QUERY,
        "in_report": _IN_REPORT,
    },
}
CHANGE_SCHEMA: Final[dict[str, Any]] = {
    "type": "object",
    "description": "The fields of a view to change; what is left out is kept.",
    "additionalProperties": False,
    "properties": {
        "name": {**_NAME, "description": "its name, one line"},
        "query": _QUERY,
        "in_report": _IN_REPORT,
        "place": {
            "type": "integer",
            "minimum": 1,
            "maximum": MAX_REPORT_FIGURES,
            "description": "its position among the figures of the report",
        },
    },
}


@dataclass(frozen=True, slots=True)
class View:
    """A view to be saved; ``study`` is None for a page of the whole service."""

    page: str
    name: str
    query: str = ""
    study: str | None = None
    in_report: bool = False

    @property
    def address(self) -> str:
        """The address of the page with its choices."""
        return address_of(self.page, self.study, self.query)


@dataclass(frozen=True, slots=True)
class ViewChange:
    """A change of a view; what is None is kept. With a ``place`` it is moved there in the report."""

    name: str | None = None
    query: str | None = None
    in_report: bool | None = None
    place: int | None = None


def address_of(page: str, study: str | None, query: str) -> str:
    """The address of a page with its choices."""
    path = f"/studies/{study}/{page}" if study is not None else "/" if page == "studies" else f"/{page}"
    return f"{path}?{query}" if query else path


def read_view(data: object) -> View:
    """The view that a request saves; raises SpecError with every fault."""
    report = Report(data)
    found = read_object(report, "", data, SCHEMA["properties"]) or {}
    page, study = found.get("page"), found.get("study")
    if page not in PAGES:
        report.fault("/page", "invalid-choice", "is not a page with views", page, allowed=", ".join(PAGES))
    elif page in STUDY_PAGES and study is None:
        report.fault(
            "/study", "required", Sentence("is required for the page {page}", page=page), allowed="the id of a study"
        )
    elif page in OWN_PAGES and study is not None:
        report.fault(
            "/study", "not-used", Sentence("does not go with the page {page}", page=page), study, allowed="null"
        )
    if study is not None and not (isinstance(study, str) and _STUDY.fullmatch(study)):
        report.fault("/study", "invalid-text", "is not an id of a study", study, allowed="the id of a study")
    name, query = _read_name(report, found), _read_query(report, found)
    if "name" not in found:
        report.fault("/name", "required", "is required", allowed=characters(1, MAX_NAME_LENGTH))
    in_report = _read_in_report(report, found, str(page)) or False
    report.raise_if_any()
    return View(str(page), name or "", query or "", study, in_report)


def read_view_change(data: object, page: str) -> ViewChange:
    """The change of a view of ``page`` that a request asks for; raises SpecError with every fault."""
    report = Report(data)
    found = read_object(report, "", data, CHANGE_SCHEMA["properties"], given=True) or {}
    name, query, in_report = _read_name(report, found), _read_query(report, found), _read_in_report(report, found, page)
    place = found.get("place")
    if "place" in found:
        allowed = span(1, MAX_REPORT_FIGURES)
        if type(place) is not int:
            report.fault("/place", "wrong-type", "must be an integer", place, allowed=allowed)
        elif not 1 <= place <= MAX_REPORT_FIGURES:
            report.fault("/place", "out-of-range", "is out of range", place, allowed=allowed)
        elif page not in FIGURES or in_report is False:
            report.fault("/place", "not-used", "needs a view that is in the report", place, allowed="left out")
    report.raise_if_any()
    return ViewChange(name, query, in_report, place)


def _read_name(report: Report, found: Mapping[str, Any]) -> str | None:
    if "name" not in found:
        return None
    name = found["name"]
    if isinstance(name, str) and name.isprintable() and 1 <= len(name.strip()) <= MAX_NAME_LENGTH:
        return name.strip()
    code: Any = "invalid-text" if isinstance(name, str) else "wrong-type"
    allowed = printable_line(MAX_NAME_LENGTH)
    report.fault("/name", code, "must be a printable text in one line", name, allowed=allowed)
    return None


def _read_query(report: Report, found: Mapping[str, Any]) -> str | None:
    """The query without parameters that are empty or say what was done before."""
    if "query" not in found:
        return None
    query = found["query"]
    if isinstance(query, str) and len(query) <= MAX_VIEW_QUERY:
        pairs = [(name, value) for name, value in parse_qsl(query.removeprefix("?")) if name not in _PASSING]
        if all((name + value).isprintable() for name, value in pairs):
            return urlencode(pairs)
    code: Any = "invalid-text" if isinstance(query, str) else "wrong-type"
    allowed = Sentence("at most {high} characters, such as x=shaft.load&y=efficiency", high=MAX_VIEW_QUERY)
    report.fault("/query", code, "must be the query of an address", query, allowed=allowed)
    return None


def _read_in_report(report: Report, found: Mapping[str, Any], page: str) -> bool | None:
    if "in_report" not in found:
        return None
    wanted = read_flag(report, "/in_report", found["in_report"])
    if wanted and page not in FIGURES:
        report.fault(
            "/in_report",
            "not-used",
            "is for figures",
            wanted,
            allowed=Sentence("views of {pages}", pages=", ".join(FIGURES)),
        )
    return wanted
