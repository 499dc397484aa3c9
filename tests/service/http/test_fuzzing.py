"""Made-up requests: no server error, no status, type or body that the documentation does not tell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest
from pydantic import SecretStr

from sprag_study.service.actor import Role
from sprag_study.service.http import attempts
from sprag_study.service.http.api.schedules import EXAMPLE
from sprag_study.service.http.app import create_app
from sprag_study.service.http.problems import ApiError
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable

    import httpx

    from sprag_study.service.settings import Settings
    from tests.service.conftest import Service

#: A spec has thousands of bounds, and a report takes a second to print: ``python -m benchmarks.fuzz`` has all.
HEAVY = {
    **dict.fromkeys(
        ("create_study", "preview_study", "extend_study", "create_schedule", "change_schedule"), ("coverage",)
    ),
    "get_report": ("examples", "coverage"),
    # Their questions are read by the code that reads those of `get_results` and `list_cases`; `get_audit` is asked
    # about times as `list_studies` is.
    **dict.fromkeys(
        (
            *("get_transient", "get_forces", "get_basin", "get_trajectory", "get_section", "get_branch", "get_strobes"),
            *("get_duty", "get_engagements", "get_yield", "get_exploration", "get_ribbon", "get_answers", "get_front"),
            *("get_curves", "get_map", "get_sensitivity", "get_calibration", "get_speeds", "get_diagram", "get_audit"),
            "get_startup",
        ),
        ("coverage",),
    ),
    # Of bodies those of `create_token`, `put_components`, `save_view` and `change_view` stand for the others.
    **dict.fromkeys(
        (
            *("fit_clutch", "select_cases", "narrow_study", "run_longer", "add_user", "change_user", "hand_over_user"),
            "change_study",
        ),
        ("coverage",),
    ),
}
#: What cases do is not computed here, and no study is of settled motion, has a goal or starts, or is a calibration.
NEVER_SERVED = {
    "POST /api/v1/studies/{study_id}:longer",
    "POST /api/v1/studies/{study_id}:narrow",
    *(
        f"GET /api/v1/studies/{{study_id}}/{which}"
        for which in (
            "calibration",
            "front",
            "cases/{case}/engagements",
            "cases/{case}/duty",
            "cases/{case}/forces",
            "cases/{case}/startup",
            "cases/{case}/strobes",
            "cases/{case}/branch",
            "cases/{case}/transient",
            "cases/{case}/speeds",
            "cases/{case}/diagram",
            "cases/{case}/section",
            "cases/{case}/basin",
            "cases/{case}/trajectory",
        )
    ),
}
#: A few made-up requests may not find the results of a map or the figures of a report, nor meet a study that nothing
#: has deleted yet; and a slow process has not heard of a worker for a while.
SELDOM_SERVED = {
    "DELETE /api/v1/studies/{study_id}",
    "GET /api/v1/studies/{study_id}/map",
    "GET /api/v1/studies/{study_id}/report",
    "GET /readyz",
}
TOKEN = "correct-horse-battery-staple"


def not_here(*_: Any, **__: Any) -> Any:
    """Stands for the engine, which has its own tests."""
    raise ApiError("not-computed", "It is not computed here.")


def things(service: Service) -> dict[str, list[Any]]:
    """Ids of a study at work with half of its rows, of ended ones, and of a schedule, by the names of parameters."""
    tolerances = {"tolerances": [{"path": "shaft.inertia", "plus_minus": "5 %"}], "drives": 2}
    ended, begun = [service.submit(), service.submit({**SPEC, **tolerances})], service.submit()
    for study_id in ended:
        service.fill(study_id)
    service.fill(begun, range(4))
    kept = [service.http.post("/api/v1/schedules", json=EXAMPLE).json()["id"] for _ in range(2)]
    for name in ("dora@example.com", "emil@example.com"):  # of the examples of bodies
        service.store.people.add_user(name, Role.DESIGNER)
    return {"study_id": [begun, *ended], "case": [0], "schedule_id": kept, "user": ["dora@example.com"]}


def test_made_up_requests_are_answered_as_documented(
    service: Service, settings: Settings, connect: Callable[..., httpx.Client], monkeypatch: pytest.MonkeyPatch
) -> None:
    from tests.service.http.fuzzing import CHECKS, fuzz, with_ids  # every process of tests would wait for schemathesis

    monkeypatch.setattr(attempts, "FIRST_SECONDS", 0.0)  # dozens of requests have an invalid token
    ids = things(service)
    service.computer.answer = not_here
    with_token = settings.model_copy(update={"token": SecretStr(TOKEN)})
    app = create_app(with_token, store=service.store, computer=service.computer, checker=service.checker)
    app.state.context.ending.set()  # streams of events end at once
    document = connect(app).get("/openapi.json", headers={"Authorization": f"Bearer {TOKEN}"}).json()
    summary = fuzz(with_ids(document, ids), TOKEN, 1, app=app, skip=HEAVY)
    told = "\n".join(f"{finding}\n{more}" for finding, more in summary.findings.items())
    assert not summary.findings, f"{summary}\n{told}"
    operations = {f"{method.upper()} {path}" for path, methods in document["paths"].items() for method in methods}
    assert operations - set(summary.served) - SELDOM_SERVED == NEVER_SERVED, sorted(operations - set(summary.served))
    assert set(summary.phases) == {"examples", "coverage", "fuzzing", "stateful"}
    assert {401, 404, 405, 422} <= set(summary.statuses)
    assert set(CHECKS) <= set(summary.checks)
