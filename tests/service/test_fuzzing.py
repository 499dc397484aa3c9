"""Made-up requests: no server error, no status, type or body that the documentation does not tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from service.api.schedules import EXAMPLE
from service.errors import ApiError
from tests.service.fuzzing import fuzz

if TYPE_CHECKING:
    from tests.service.conftest import Service


def not_here(*_: Any, **__: Any) -> Any:
    """Stands for the engine, which has its own tests."""
    raise ApiError("not-computed", "It is not computed here.")


def test_made_up_requests_are_answered_as_documented(service: Service) -> None:
    context = service.app.state.context
    study_id = service.submit()
    service.fill(study_id)
    context.ending.set()  # streams of events end at once
    service.computer.answer = not_here
    kept = service.http.post("/api/v1/schedules", json=EXAMPLE).json()["id"]
    summary = fuzz(service.http, {"study_id": study_id, "case": "0", "schedule_id": kept}, examples=3)
    assert summary.findings == [], "\n".join([str(summary), *summary.findings])
    assert summary.operations >= 30
    assert summary.cases > 3 * summary.operations
