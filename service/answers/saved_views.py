"""Answers about saved views."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment


class SavedViewEntry(TypedDict):
    """The address of a page under a name."""

    id: str
    page: Annotated[str, Doc("the page: curves, map, explore, front, drives, sensitivity, cases, studies, compare")]
    study: Annotated[str | None, Doc("the study of the page; null: a page of the whole service")]
    name: str
    query: Annotated[str, Doc("the choices as the query of the page's address")]
    address: Annotated[str, Doc("address of the page with the choices")]
    place: Annotated[int | None, Doc("position among the figures of the study's report; null: it is not in it")]
    changed_at: Moment
    etag: Annotated[str, Doc("edition of its name, choices and place, for `If-Match`")]
    owner: Annotated[str | None, Doc("the user who saved it; null where nobody did: then every designer may change it")]


class SavedViewList(TypedDict):
    """Views: the figures of reports in order, then the others by name."""

    views: list[SavedViewEntry]
