"""OpenAPI links: ids that one operation returns and others accept."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final


@dataclass(frozen=True, slots=True)
class Link:
    """A value in the answer of ``source`` with ``status`` that ``target`` accepts, as parameters or as its body."""

    source: str
    status: str
    target: str
    parameters: tuple[tuple[str, str], ...] = ()
    body: str | None = None

    def to_json(self) -> dict[str, Any]:
        """The link object of OpenAPI."""
        return {
            "operationId": self.target,
            **({"parameters": dict(self.parameters)} if self.parameters else {}),
            **({"requestBody": self.body} if self.body else {}),
        }


_OF_A_STUDY: Final = (
    "get_study",
    "delete_study",
    "cancel_study",
    "pause_study",
    "resume_study",
    "retry_study",
    "extend_study",
    "prioritize_study",
    "get_events",
    "get_curves",
    "get_map",
    "get_results",
    "get_report",
    "get_sensitivity",
    "list_cases",
)
_OF_A_CASE: Final = ("get_case", "get_trajectory", "get_engagements")
_OF_A_SCHEDULE: Final = ("get_schedule", "change_schedule", "delete_schedule")
_SPEC_TAKERS: Final = ("preview_study", "create_study")


def _all() -> Iterable[Link]:
    for source, status, found in (
        ("create_study", "202", "$response.body#/id"),
        ("extend_study", "202", "$response.body#/id"),
        ("list_studies", "200", "$response.body#/studies/0/id"),
    ):
        for target in _OF_A_STUDY:
            yield Link(source, status, target, (("study_id", found),))
    own = ("study_id", "$request.path.study_id")
    for target in _OF_A_CASE:
        yield Link("list_cases", "200", target, (own, ("case", "$response.body#/cases/0/case")))
    for source, status, found in (
        ("create_schedule", "201", "$response.body#/id"),
        ("list_schedules", "200", "$response.body#/schedules/0/id"),
    ):
        for target in _OF_A_SCHEDULE:
            yield Link(source, status, target, (("schedule_id", found),))
    for source in ("get_study", "get_preset", "get_schedule"):
        for target in _SPEC_TAKERS:
            yield Link(source, "200", target, body="$response.body#/spec")
    yield Link("list_presets", "200", "get_preset", (("name", "$response.body#/presets/0/name"),))
    yield Link("list_models", "200", "get_model", (("name", "$response.body#/models/0/name"),))


LINKS: Final = tuple(_all())


def add_links(document: dict[str, Any]) -> None:
    """Add the links to the answers of an OpenAPI document."""
    operations = {
        operation["operationId"]: operation for item in document["paths"].values() for operation in item.values()
    }
    for link in LINKS:
        answer = operations[link.source]["responses"][link.status]
        answer.setdefault("links", {})[operations[link.target]["operationId"]] = link.to_json()
