"""Answers about the office's own components."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment


class ComponentEntry(TypedDict):
    """A spring, a clutch or a motor of the catalogue."""

    id: str
    kind: Annotated[str, Doc("spring, clutch or motor")]
    name: Annotated[str, Doc("unique within the kind")]
    note: str
    fields: Annotated[dict[str, str], Doc("quantities as they were written, by field")]
    changed_at: Moment
    etag: Annotated[str, Doc("edition of its note and fields, for `If-Match`")]
    owner: Annotated[str | None, Doc("the user who added it; null: nobody, so every designer may change it")]


class ComponentList(TypedDict):
    """Components by kind and name."""

    components: list[ComponentEntry]
