"""The page on which measured points are pasted: they calibrate the machine of a study."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Final

from fastapi import Query
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import Fault, FaultError
from sprag.service.http.context import Context, Ctx
from sprag.service.http.problems import api_error
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.form.entries import range_of
from sprag.service.http.web.form.values import Form
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs import checks
from sprag.service.jobs.submission import take_in
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.reader import Reading
from sprag.service.spec.kinds.registry import without_cases
from sprag.service.spec.stored import accepted
from sprag.worker import models
from sprag.worker.limits import MAX_NAME_LENGTH
from sprag.worker.planning.calibrate.plan import LOSSES

if TYPE_CHECKING:
    from sprag.service.jobs.submission import Submission

router = page_router()

#: Rows for unknown parameters.
ROWS: Final = 6
_SUFFIX: Final = ", calibrated"


@router.get("/calibrate")
def calibrate_page(context: Ctx, study: Annotated[str, Query(max_length=64)]) -> Response:
    """The empty page for the machine of a study."""
    return _page(context, study, {}, ())


@router.post("/calibrate")
async def send_points(context: Ctx, work: Attended, values: Form) -> Response:
    """Submit the calibration, or show what is wrong with it."""
    study_id = values.get("study", "")
    spec = await in_thread(context.store.studies.spec, study_id)
    study = await in_thread(context.store.studies.study, study_id)
    content = json.dumps(calibration_spec(await in_thread(accepted, spec, study), values)).encode()
    try:
        made = await work.check(
            checks.new_study, context.library, content, "json", False, None, context.store.clock.now(), {}
        )
        return await in_thread(_submit, context, made)
    except FaultError as error:
        faults = error.faults or (Fault(None, "conflict", error.detail),)
        return await in_thread(_page, context, study_id, values, faults, api_error(error).type.status)


def _submit(context: Context, made: Submission) -> Response:
    return RedirectResponse(f"/studies/{take_in(context.store, made).id}", status_code=303)


def calibration_spec(spec: Mapping[str, Any], values: Mapping[str, str]) -> dict[str, Any]:
    """The spec of a calibration of the machine of ``spec``, with the fields of the page."""
    kept = without_cases(spec)
    unknown = [
        {"path": path, **range_of({name: values.get(f"{name}{row}", "") for name in ("from", "to")}, "")}
        for row in range(ROWS)
        if (path := values.get(f"path{row}", "").strip())
    ]
    name = str(spec.get("name", ""))[: MAX_NAME_LENGTH - len(_SUFFIX)] + _SUFFIX
    measured = {"csv": values.get("measured", "")}
    return {
        **kept,
        "name": name,
        "calibrate": {"unknown": unknown, "measured": measured, "loss": values.get("loss", LOSSES[0])},
    }


def _page(
    context: Context, study_id: str, values: Mapping[str, str], faults: tuple[Fault, ...], status: int = 200
) -> Response:
    study, record = context.store.studies.study(study_id), context.store.studies.get(study_id)
    paths = [path for path in study.base if path not in study.derive]
    infos = [info for info in models.study_results(study) if info.kind != "category"]
    first = models.presentation_of(study).along[:1]
    reading = Reading(study.model)
    example = [f"{path} [{unit_of(study, path)}]" for path in first] + [f"{infos[0].name} [{infos[0].unit}]", "sigma"]
    return page(
        "calibrate.html",
        status=status,
        study_id=study_id,
        study_name=record.name or study_id,
        values=values,
        faults=faults,
        rows=range(ROWS),
        paths=[(path, reading.caption(path), unit_of(study, path), study.base[path]) for path in paths],
        results=[(info.name, info.unit) for info in infos],
        losses=LOSSES,
        example=",".join(example),
    )
