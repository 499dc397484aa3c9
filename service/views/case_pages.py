"""Pages of a study's cases: by number, or sorted and chosen by ranges over all of them, as in Explore."""

from __future__ import annotations

import base64
import json
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.service.exports import rows_json
from sprag_study.service.faults import choice_of, parameter_error
from sprag_study.service.reading.directions import case_units
from sprag_study.service.results.explore import After, ExploreQuery, plan_of
from sprag_study.service.storage.studies.records import RowBlock
from sprag_study.service.views.curves import pairs
from sprag_study.service.views.explore import explored, selection
from sprag_study.worker import models
from sprag_study.worker.codes import FLAG_MASKS

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.service.answers import results as m
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.study_questions import CasesQuestion
    from sprag_study.worker.study import Study

_ALLOWED = "`next_page_token` of a page of the same order"


@dataclass(frozen=True, slots=True)
class CasePage:
    """Rows of a page in their order, the token of the next one, and how many cases match (None: not counted)."""

    block: RowBlock
    next_token: str | None
    matching: int | None


def wanted(question: CasesQuestion) -> ExploreQuery:
    """The cases of a question, as many as a page has."""
    for name in ("ending", "regime", "flag"):
        if getattr(question, name) == "":
            raise parameter_error(name, "invalid-choice", "is empty", "", "a name, or no parameter for any")
    return replace(selection(question, question.page_size), at=pairs(question.at))


def page_json(study: Study, page: CasePage) -> m.CasePage:
    """A page as JSON data."""
    return {"cases": list(rows_json(study, page.block)), "units": case_units(study), "next_page_token": page.next_token}


def by_number(query: ExploreQuery) -> bool:
    """Whether a page is read straight from the database: cases in the order of their numbers, of any values."""
    return query.sort == "case" and not (query.where or query.at)


def check(study: Study, query: ExploreQuery) -> None:
    """Refuse what a study has not, before its cases are run; `case_page` refuses it as well. FaultError."""
    if by_number(query):
        _require_kinds(query)
    else:
        plan_of(study, query)


def case_page(library: Library, study_id: str, query: ExploreQuery, page_token: str | None) -> CasePage:
    """At most ``query.limit`` finished cases after those of the page before.

    By number also those that a cancelled study never ran. A page begins after the last case of the one before, also
    when more cases have finished since. Raises StudyNotFoundError, and FaultError for what `plan_of` refuses, or a
    token that is not of this order.
    """
    if by_number(query):
        return _numbered(library, study_id, query, page_token)
    after = None if page_token is None else _read_token(page_token, query.sort)
    found = explored(library, study_id, replace(query, limit=query.limit + 1, after=after))
    places = found.order[: query.limit]
    infos = found.infos
    cases = found.rows.cases[places]
    rows = library.store.rows.for_cases(study_id, cases, [info.name for info in infos])
    block = RowBlock(
        infos,
        cases,
        [ending or "" for ending in rows.endings],
        rows.flags or [""] * len(cases),
        np.column_stack([rows.values[info.name] for info in infos]) if len(cases) else np.empty((0, len(infos))),
    )
    token = None
    if found.order.size > query.limit:
        key = float(found.keys[places[-1]])
        text = json.dumps([query.sort, None if np.isnan(key) else key, int(cases[-1])])
        token = base64.urlsafe_b64encode(text.encode()).decode().rstrip("=")
    return CasePage(block, token, found.count)


def _require_kinds(query: ExploreQuery) -> None:
    """Raise FaultError for an ending, a regime or a flag of no model."""
    known: dict[str, Iterable[str]] = {
        "ending": models.ENDING_SENTENCES,
        "regime": models.REGIME_SENTENCES,
        "flag": FLAG_MASKS,
    }
    for name, names in known.items():
        if chosen := getattr(query, name):
            choice_of(name, chosen, map(str, names))


def _numbered(library: Library, study_id: str, query: ExploreQuery, page_token: str | None) -> CasePage:
    _require_kinds(query)
    if page_token is not None and not (page_token.isascii() and page_token.isdigit() and len(page_token) < 19):
        raise _not_a_token(page_token)
    kinds = (query.ending or None, query.regime or None, query.flag or None)
    # One more than the page, which shows whether there is another page.
    block = library.store.rows.page(study_id, -1 if page_token is None else int(page_token), query.limit + 1, *kinds)
    if len(block) <= query.limit:
        return CasePage(block, None, None)
    own = slice(query.limit)
    block = replace(block, cases=block.cases[own], endings=block.endings[own], flags=block.flags[own],
                    values=block.values[own])  # fmt: skip
    return CasePage(block, str(block.cases[-1]), None)


def _read_token(token: str, sort: str) -> After:
    try:
        name, key, case = json.loads(base64.b64decode(token + "=" * (-len(token) % 4), altchars=b"-_", validate=True))
        if name == sort and type(case) is int and 0 <= case < 2**31 and (key is None or type(key) is float):
            return After(np.nan if key is None else key, case)
    except (ValueError, TypeError, RecursionError):
        pass
    raise _not_a_token(token)


def _not_a_token(token: str) -> Exception:
    return parameter_error("page_token", "invalid-text", "is not a token of this list", token, _ALLOWED)
