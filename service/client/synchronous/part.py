"""What every part of a study has: the connection and the study's address."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sprag_study.service.client.wire import case_path, study_path

if TYPE_CHECKING:
    from sprag_study.service.client.synchronous.connection import Connection
    from sprag_study.service.client.wire import Query


class StudyPart:
    """A study at its address.

    Attributes
    ----------
    id : str
        Its public name.
    summary : mapping or None
        What the service last said of it: name, state, progress and so on; None before.
    """

    def __init__(self, client: Connection, study_id: str, summary: Mapping[str, Any] | None = None) -> None:
        self._client = client
        self._path = study_path(study_id)
        self.id, self.summary = study_id, summary

    def _of_case(self, case: int, part: str = "", query: Query = ()) -> dict[str, Any]:
        return self._client.request("GET", case_path(self.id, case, part), params=list(query))

    def _get(self, part: str, query: Query = ()) -> dict[str, Any]:
        return self._client.request("GET", self._path + part, params=list(query))
