"""Studies and cases for the API: plain data from the store's records."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, cast

from sprag_study.service.answers import filled
from sprag_study.service.answers.catalogue import Preset
from sprag_study.service.answers.results import CaseDetail, RegimeRow
from sprag_study.service.answers.studies import FullProgress, Origin, StudyDetail, StudySummary
from sprag_study.service.exports import row_json
from sprag_study.service.faults import warned
from sprag_study.service.http.prefix import here
from sprag_study.service.http.respond import edition_tag
from sprag_study.service.presets import ABOUT, preset_text
from sprag_study.service.reading.catalogue import axes_json
from sprag_study.service.reading.directions import case_units, case_values
from sprag_study.service.results.fronts import goal_units
from sprag_study.service.results.rounds import rounds_json
from sprag_study.service.spec.document import format_of, load_spec
from sprag_study.service.storage.studies.records import CaseRow
from sprag_study.worker import models
from sprag_study.worker.codes import PENDING
from sprag_study.worker.models.abilities import has_reactions, has_speeds, has_start_ups, has_transients

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.storage.rows.origins import Origin as OriginRecord
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import Kinds, Progress, StudyRecord
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

API_PREFIX: Final = "/api/v1"


def study_address(study_id: str) -> str:
    """Address of a study in the API."""
    return here(f"{API_PREFIX}/studies/{study_id}")


def study_links(study_id: str) -> dict[str, str]:
    """URLs of the resources of a study."""
    own = study_address(study_id)
    parts = {
        name: f"{own}/{name}"
        for name in ("cases", "results", "curves", "map", "sensitivity", "report", "rounds", "events")
    }
    return {"self": own, **parts, "cancel": f"{own}:cancel", "page": here(f"/studies/{study_id}")}


def summary(record: StudyRecord) -> StudySummary:
    """A study without its spec."""
    return filled(
        StudySummary,
        record,
        **warned(record.warnings),
        state_meaning=record.state.sentence,
        progress={"total": record.cases, "done": record.done, "ok": record.ok},
        links=study_links(record.id),
    )


def study_tag(record: StudyRecord) -> str:
    """Entity tag of a study: a weak one while it runs, because its time left changes with no change of the study."""
    tag = edition_tag(record.etag, record.id, record.revision)
    return tag if record.state.terminal else f"W/{tag}"


def progress_json(progress: Progress, units: Sequence[str] = ()) -> FullProgress:
    """Progress of a study, its rate and its time left; ``units`` are those of the goals of a search."""
    left, covered = progress.seconds_left, progress.covered
    return filled(
        FullProgress,
        progress,
        seconds_left=None if left is None else {"low": left[0], "high": left[1]},
        passes=None if covered is None else asdict(covered),
        rounds=None if progress.rounds is None else rounds_json(progress.rounds, progress.state, units),
    )


def whole_detail(library: Library, record: StudyRecord, progress: Progress) -> StudyDetail:
    """A study with everything, as of `detail`, and with warnings of parameters without effect."""
    store, study_id = library.store, record.id
    parts = store.studies.study(study_id), store.studies.spec(study_id), store.rows.kinds(study_id)
    data = detail(record, progress, *parts, store.rows.origins(study_id))
    unaffected = warned((*record.warnings, *library.unaffected(record)))
    return cast("StudyDetail", {**data, **unaffected})


def detail(
    record: StudyRecord,
    progress: Progress,
    study: Study,
    spec: dict[str, Any],
    kinds: Kinds,
    origins: Sequence[OriginRecord],
) -> StudyDetail:
    """A study with everything; ``record`` and ``progress`` come from one transaction (`Studies.look`)."""
    return {
        **summary(record),
        "progress": progress_json(progress, goal_units(study)),
        "combine": study.combine,
        "axes": axes_json(study),
        "derive": dict(study.derive),
        "physics_hash": record.physics_hash,
        "regimes": kinds.regimes,
        "flags": kinds.flags,
        "computed_by": [filled(Origin, origin) for origin in origins],
        "spec": spec,
    }


def case_detail(store: Store, study_id: str, study: Study, case: int) -> CaseDetail:
    """A case with its parameters, results and regimes; "pending" while it has not been run."""
    row = store.rows.case(study_id, case)
    parameters = case_values(study, case)
    if row is None:
        names = [info.name for info in models.study_results(study)]
        row = CaseRow(case, PENDING, (), dict.fromkeys(names))
    own = f"{study_address(study_id)}/cases/{case}"
    links = {"self": own, "study": study_address(study_id), "trajectory": f"{own}/trajectory"}
    if has_transients(study):
        links["transient"] = f"{own}/transient"
    if has_speeds(study):
        links["speeds"] = f"{own}/speeds"
    if models.has_clutches(study):
        links |= {name: f"{own}/{name}" for name in ("engagements", "duty")}
    if has_reactions(study):
        links["forces"] = f"{own}/forces"
    if has_start_ups(study):
        links["startup"] = f"{own}/startup"
    if models.has_strobes(study):
        links["strobes"] = f"{own}/strobes"
        links |= {name: f"{own}/{name}" for name in ("branch", "diagram", "section")}
    return cast(
        "CaseDetail",
        {
            **row_json(row, parameters),
            "units": case_units(study),
            "ending_meaning": models.ENDING_SENTENCES.get(row.ending, "The case has not been run yet."),
            "flag_meanings": {flag: models.flags_of(study.model).get(flag, "") for flag in row.flags},
            "regimes": _regimes(store, study_id, study, case),
            "links": links,
        },
    )


def _regimes(store: Store, study_id: str, study: Study, case: int) -> list[RegimeRow]:
    """The rows of a case that can have several."""
    numbered = models.numbered_by(study.model, models.variant_of(study))
    rows = () if numbered is None else store.rows.of_case(study_id, case)
    return [{"number": number, "flags": list(row.flags), "results": row.results} for number, row in enumerate(rows)]


@lru_cache
def preset_of(name: str) -> Preset:
    """A preset with its spec and description; KeyError for an unknown name."""
    file, text = preset_text(name)
    spec = cast("dict[str, Any]", load_spec(text, format_of(file)))
    return {
        "name": name,
        "title": spec["name"],
        "model": spec["model"],
        "shows": ABOUT[name].shows,
        "values": ABOUT[name].values,
        "cases": ABOUT[name].cases,
        "spec": spec,
    }
