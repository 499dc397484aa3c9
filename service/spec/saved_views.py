"""Saved views: the address of a page under a name. One of curves or of a map can be a figure of the study's report."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final
from urllib.parse import parse_qsl, urlencode

from sprag_study.sentences import Sentence
from sprag_study.service.reading.limits import characters, span
from sprag_study.service.spec.described import Described, Record
from sprag_study.service.spec.labels import NAME, read_line, text_code
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_REPORT_FIGURES, MAX_VIEW_QUERY

#: Pages whose views can be figures of the report.
FIGURES: Final = ("curves", "map")
#: Pages of a study, and those of the whole service.
STUDY_PAGES: Final = (*FIGURES, "explore", "front", "drives", "sensitivity", "cases", "document", "rows")
OWN_PAGES: Final = ("studies", "compare")
PAGES: Final = (*STUDY_PAGES, *OWN_PAGES)
#: Parameters of addresses that say what was done before, or where a list goes on.
_PASSING: Final = frozenset({"done", "changed", "after"})
_STUDY: Final = re.compile(r"[A-Za-z0-9_-]{1,64}")
_IN_REPORT: Final = Described("in_report", "", "whether it is a figure of the study's report", "flag")
_QUERY: Final[dict[str, Any]] = {
    "type": "string",
    "maxLength": MAX_VIEW_QUERY,
    "description": "the choices as the query of the page's address, without `?`",
}

#: A view to be saved, and a change.
VIEW: Final = Record(
    {
        "page": {"enum": list(PAGES)},
        "study": {
            "type": ["string", "null"],
            "pattern": f"^{_STUDY.pattern}$",
            "description": "the study of the page; null for `studies` and `compare`",
        },
        "name": NAME,
        "query": _QUERY,
        "in_report": _IN_REPORT,
    },
    "A view to save; one of the same study, page and name is replaced.",
    required=("page", "name"),
)
CHANGE: Final = Record(
    {
        "name": NAME,
        "query": _QUERY,
        "in_report": _IN_REPORT,
        "place": {
            "type": "integer",
            "minimum": 1,
            "maximum": MAX_REPORT_FIGURES,
            "description": "its position among the figures of the report",
        },
    },
    "The fields of a view to change; what is left out is kept.",
)


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
    node = Node(Report(data), "", data)
    VIEW.read(node)
    page, study = node["page"], node["study"]
    if page.value not in PAGES:
        page.refuse("invalid-choice", "is not a page with views", allowed=", ".join(PAGES))
    elif page.value in STUDY_PAGES and study.value is None:
        message = Sentence("is required for the page {page}", page=page.value)
        study.refuse("required", message, allowed="the id of a study")
    elif page.value in OWN_PAGES and study.value is not None:
        study.refuse("not-used", Sentence("does not go with the page {page}", page=page.value), allowed="null")
    if study.value is not None and not (isinstance(study.value, str) and _STUDY.fullmatch(study.value)):
        study.refuse("invalid-text", "is not an id of a study", allowed="the id of a study")
    name, query = read_line(node["name"]), _read_query(node["query"])
    if "name" not in node:
        node["name"].refuse("required", "is required", allowed=characters(1, MAX_NAME_LENGTH))
    in_report = _read_in_report(node, str(page.value)) or False
    node.report.raise_if_any()
    return View(str(page.value), name or "", query or "", study.value, in_report)


def read_view_change(data: object, page: str) -> ViewChange:
    """The change of a view of ``page`` that a request asks for; raises SpecError with every fault."""
    node = Node(Report(data), "", data)
    CHANGE.read(node, null=False)
    name, query, in_report = read_line(node["name"]), _read_query(node["query"]), _read_in_report(node, page)
    place = node["place"]
    if place.given:
        allowed = span(1, MAX_REPORT_FIGURES)
        if type(place.value) is not int:
            place.refuse("wrong-type", "must be an integer", allowed=allowed)
        elif not 1 <= place.value <= MAX_REPORT_FIGURES:
            place.refuse("out-of-range", "is out of range", allowed=allowed)
        elif page not in FIGURES or in_report is False:
            place.refuse("not-used", "needs a view that is in the report", allowed="left out")
    node.report.raise_if_any()
    return ViewChange(name, query, in_report, place.value)


def _read_query(node: Node) -> str | None:
    """The query without parameters that are empty or say what was done before."""
    query = node.value
    if isinstance(query, str) and len(query) <= MAX_VIEW_QUERY:
        pairs = [(name, value) for name, value in parse_qsl(query.removeprefix("?")) if name not in _PASSING]
        if all((name + value).isprintable() for name, value in pairs):
            return urlencode(pairs)
    if node.given:
        allowed = Sentence("at most {high} characters, such as x=shaft.load&y=efficiency", high=MAX_VIEW_QUERY)
        node.refuse(text_code(query), "must be the query of an address", allowed=allowed)
    return None


def _read_in_report(view: Node, page: str) -> bool | None:
    node = view["in_report"]
    wanted = node.flag() if node.given else None
    if wanted and page not in FIGURES:
        node.refuse("not-used", "is for figures", allowed=Sentence("views of {pages}", pages=", ".join(FIGURES)))
    return wanted
