"""The machine of a form while it is drawn: its motion and results at once, and a result along each of its numbers."""

from __future__ import annotations

import asyncio
import logging
import os
import re
from contextlib import suppress
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, Final

import psutil
from fastapi import Query
from starlette.responses import Response

from sprag_study.service.http.current import current
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.figures.live import along, live_case, values_of_result
from sprag_study.service.http.web.form.beginning import beginning
from sprag_study.service.http.web.form.entries import Values, plain
from sprag_study.service.http.web.form.machine import BASE, choices_of, entries, form_of, model_name, row_of
from sprag_study.service.http.web.form.machine_spec import base_of
from sprag_study.service.http.web.form.own_machine import single_machine
from sprag_study.service.http.web.form.sent import ends_of, settle, with_first_values
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.templates import fragment
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.reading.reader import meanings, reading_for
from sprag_study.service.results.regimes import motion_sentence
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.fields import base_path
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.machine.shaft_check import NotCompiledError
from sprag_study.service.spec.report import SpecError
from sprag_study.worker import models
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.vibration_drive.settled import swings
from sprag_study.worker.pool.child_pool import JobStoppedError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.http.context import Context
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

router = page_router()
_LOG: Final = logging.getLogger("sprag.service")

#: Values of a number along which a result is drawn.
_VALUES: Final = 25
#: Seconds between two looks whether checks are possible.
_LOOK: Final = 0.5
#: Seconds of a service without a page before it computes the first machines all the same.
_UNVISITED_SECONDS: Final = 20.0
#: Seconds that a service without a page waits for a core that nothing else uses.
_BUSY_SECONDS: Final = 600.0
#: Width of the picture (px), unless the page says another.
_WIDTH: Final = 560


def drawn_machine(values: Mapping[str, str]) -> tuple[Study, dict[str, Any]] | None:
    """The machine of a form as a study of one case, with its spec; None while it has faults, and where it does not
    settle.
    """
    spec, _faults = spec_of(with_first_values(values))
    try:
        parsed = parse_spec({**without_cases(spec), "axes": [], "quantities": {}})
    except SpecError:
        try:
            parsed = parse_spec(single_machine(spec))  # what only an axis gives has a value of it
        except SpecError:
            return None
    study = parsed.study
    if swings(case_machine(study, 0)):
        return None
    unsettled = models.has_strobes(study) and not models.is_settled(study.run)
    return (models.settled_study(study) if unsettled else study), parsed.spec


def studies_along(values: Mapping[str, str], spec: Mapping[str, Any]) -> list[tuple[str, Study]]:
    """By the name of its field, a study along each number in sight of a machine that can be computed at once."""
    found = []
    for entry in entries(values):
        path = base_path(entry.name)
        usual = {entry.name: values.get(entry.name, "").strip() or entry.field.default}
        ends = ends_of({**values, **usual}, path) if entry.tolerant and form_of(values).in_sight(path) else None
        if ends is not None:
            axis = {"path": path, "linspace": [*map(plain, ends), _VALUES]}
            try:
                study = parse_spec({**spec, "axes": [axis]}).study
            except SpecError:
                continue
            found.append((entry.name, study))
    return found


def studies_without(values: Mapping[str, str], spec: Mapping[str, Any]) -> list[tuple[str, Study]]:
    """By the pointer of each part of a machine of several parts, a study of the machine without it."""
    studies = []
    for rows in form_of(values).lists:
        parts = spec["base"].get(rows.at, ()) if rows.alone else ()
        for index in range(len(parts)) if len(parts) > 1 else ():
            others = [{} if other == index else part for other, part in enumerate(parts)]
            with suppress(SpecError):  # such as a formula that has a number of the part
                study = parse_spec({**spec, "base": {**spec["base"], rows.at: others}, "axes": []}).study
                studies.append((f"{BASE}/{rows.at}/{index}", study))
    return studies


async def live_answer(work: Work, values: Values, width: int = _WIDTH) -> dict[str, Any] | None:
    """The answer to a form: its text with the picture, and the frames of the drawing; None while it has faults."""
    drawn = await work.check(drawn_machine, values)
    if drawn is None:
        return None
    study, spec = drawn
    reading = reading_for(study, spec, current().choice)
    case = await work.run_case(live_case, study, reading, width)
    text = await in_thread(_text, study, reading, case)
    return {"answer": text, "frames": case["frames"]}


def _text(study: Study, reading: Reading, case: dict[str, Any]) -> str:
    shown = models.presentation_of(study)
    own, infos = shown.laboratory, models.results_by_name(study)
    main = own.main or dict.fromkeys(name for name in shown.drawn if name in infos)
    rows = [
        (infos[name], main.get(name) or "", case["results"].get(name))
        for name in (*main, *shown.main[:4]) if name in infos and case["results"].get(name) is not None
    ]  # fmt: skip
    return fragment(
        "_live.html",
        case=case,
        rows={info.name: (info, label, value) for info, label, value in rows}.values(),
        reading=reading,
        sentence=meanings(models.ENDING_SENTENCES).get(case["ending"], ""),
        motion=motion_sentence(case["regime"], case["order"] or None) if case["regime"] else "",
        turns=study.structure is not None,
        degrees=360 * int((study.structure or {}).get("cycle", 1)),
        note=own.note,
    )


@router.post("/new/live")
async def live(work: Attended, values: Form, width: Annotated[int, Query(ge=240, le=1200)] = _WIDTH) -> Response:
    """Motion and results of the machine as it is drawn."""
    settle(values)
    return json_response(await live_answer(work, values, width) or {"answer": "", "frames": None})


@router.post("/new/along")
async def curves_along(work: Attended, values: Form) -> Response:
    """Thumbnails of the main result along each number, and its value without each part of the machine, where the model
    is computed at once.
    """
    settle(values)
    result = models.model_of(model_name(values)).presentation.laboratory.along
    drawn = await work.check(drawn_machine, values) if result else None
    if drawn is None:
        return json_response({"sparks": {}})
    studies = await work.check(studies_along, values, drawn[1])
    without = await work.check(studies_without, values, drawn[1])
    found, alone = await work.run_case(_along, drawn[0], studies, without, result)
    reading = reading_for(drawn[0], drawn[1], current().choice)
    label = models.presentation_of(drawn[0]).laboratory.main.get(result) or result
    info = next(info for info in models.study_results(drawn[0]) if info.name == result)

    def made() -> dict[str, str]:
        sparks: dict[str, str] = {
            name: fragment("_spark.html", curve=curve, ends=ends, info=info, reading=reading, label=label)
            for name, (curve, *ends) in found.items()
        }
        return sparks | {
            part: fragment("_without.html", value=value, info=info, reading=reading, label=label)
            for part, value in alone.items()
        }

    return json_response({"sparks": await in_thread(made)})


def _along(
    _study: Study, studies: list[tuple[str, Study]], without: list[tuple[str, Study]], result: str
) -> tuple[dict[str, tuple[str, float, float]], dict[str, float]]:
    return along(studies, result), values_of_result(without, result)


def _read_ahead() -> None:
    """Read in this process what the forms begin with."""
    for model in models.model_names():
        values = values_of(beginning(model))
        choices_of(values, base_of(values, {}))


def _has_time(passed: float) -> bool:
    """Whether a service without visits computes ahead, so many seconds after its start."""
    if not _UNVISITED_SECONDS < passed < _BUSY_SECONDS:
        return passed >= _BUSY_SECONDS
    try:
        running, *_ = psutil.getloadavg()
    except OSError:  # a sandbox may hide it
        return True
    return running < (os.cpu_count() or 1)


async def warm(context: Context) -> None:
    """Compute the machine with which the form of each model begins, so that nobody waits for the first one.

    It begins with the first page, or where none is opened in `_UNVISITED_SECONDS`: beside the start of a service it
    would take a core from the first requests, and as much processor time as the rest of the start. On a busy machine it
    waits longer, until a core is free or `_BUSY_SECONDS` have passed.
    """
    started = monotonic()
    try:
        while not context.ready.is_set() or not (context.visited.is_set() or _has_time(monotonic() - started)):
            await asyncio.sleep(_LOOK)
        await in_thread(_read_ahead)
        for model in models.model_names():
            values = values_of(beginning(model)) | {"axes": "0"}
            drawn = await context.checker.run(drawn_machine, values)
            if drawn is not None:
                study, spec = drawn
                await context.computer.load(models.shape_of(study))
                await context.computer.run(live_case, study, reading_for(study, spec, current().choice), _WIDTH)
                if result := models.presentation_of(study).laboratory.along:
                    first = (await context.checker.run(studies_along, values, spec))[:1]
                    await context.computer.run(_along, study, first, [], result)
    except (ApiError, JobStoppedError, NotCompiledError) as error:
        _LOG.info("The first machines are not computed ahead: %s", error)


def named_numbers(model: str, key: str, paths: list[str]) -> list[str]:
    """The numbers that a question such as "the load" is about, among those of a machine."""
    pattern = models.model_of(model).presentation.laboratory.studies.get(key)
    if pattern is None:
        return [path for path in paths if path == key]
    return [path for path in paths if re.fullmatch(pattern, row_of(model, path)[2])]
