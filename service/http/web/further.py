"""What a study's page does as the commands do: change its priority, and extend it by values or cases."""

from __future__ import annotations

import hashlib
import json
from typing import Any

from starlette.concurrency import run_in_threadpool
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import parameter_error
from sprag.service.http.context import Ctx, StudyId
from sprag.service.http.routers import page_router
from sprag.service.http.web.form.entries import Values, list_of
from sprag.service.http.web.form.values import Form
from sprag.service.http.work import Attended
from sprag.service.jobs import checks
from sprag.service.jobs.submission import take_in
from sprag.service.spec.numbers import parse_number
from sprag.worker.limits import MAX_PRIORITY

router = page_router()


@router.post("/studies/{study_id:study}/priority")
def change_priority(context: Ctx, study_id: StudyId, values: Form) -> Response:
    """The field of a study that has not ended: among waiting studies the highest priority runs first."""
    text = values.get("priority", "").strip()
    number = parse_number(text)
    if number is None or not abs(number) <= MAX_PRIORITY or number != int(number):
        allowed = f"a whole number from {-MAX_PRIORITY} to {MAX_PRIORITY}"
        raise parameter_error("priority", "out-of-range", "is not a priority", text, allowed)
    context.store.prioritize_study(study_id, int(number))
    return RedirectResponse(f"/studies/{study_id}", status_code=303)


@router.post("/studies/{study_id:study}/extend")
async def extend(context: Ctx, work: Attended, study_id: StudyId, values: Form) -> Response:
    """The form for further values of the axes, or further cases: submit the extended study."""
    content = json.dumps(_addition(values), sort_keys=True).encode()
    now = context.store.clock.now()
    made = await work.check(checks.extended_study, context.library, study_id, content, "json", None, now, {})
    # Pressed twice, it submits one study.
    key = f"extend-{study_id}-{hashlib.sha256(content).hexdigest()[:32]}"
    record = await run_in_threadpool(take_in, context.store, made, key)
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


def _addition(values: Values) -> dict[str, Any]:
    """The extension that the form describes; FaultError unless it is either of values or of cases."""
    axes = [
        {"path": name.removeprefix("axis:"), "values": entries}
        for name, text in values.items()
        if name.startswith("axis:") and (entries := list_of(text))
    ]
    points = values.get("points", "").strip()
    if bool(axes) == bool(points):
        message = "give further values of axes, or further cases, and not both"
        raise parameter_error("points", "exactly-one", message, allowed="values, or a table of cases")
    named = {"name": name} if (name := values.get("name", "").strip()) else {}
    return {**({"axes": axes} if axes else {"cases": [{"points": points}]}), **named}
