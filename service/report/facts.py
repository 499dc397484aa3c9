"""What a report says of its study: identity, state, versions and hashes."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from importlib.metadata import version
from typing import TYPE_CHECKING, Any

from sprag_study.service.languages import _
from sprag_study.service.reading.reader import model_title
from sprag_study.service.reading.wording import number

if TYPE_CHECKING:
    from sprag_study.service.report.office import Office
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.study import Study


def facts_of(record: StudyRecord, study: Study, spec: Mapping[str, Any], office: Office) -> tuple[tuple[str, str], ...]:
    """Names and values of a study; ``spec`` is the user's own."""
    ended = record.finished_at
    counts = {"cases": number(record.cases), "done": number(record.done), "ok": number(record.ok)}
    return (
        (_("study"), record.id),
        (_("model"), model_title(record.model)),
        (_("state"), f"{_(record.state.value)}: {_(record.state.sentence)}"),
        (_("cases"), _("{cases}, of which {done} are done and {ok} ended ok", **counts)),
        (_("axes"), _combined(study)),
        (_("submitted"), office.moment(record.created_at)),
        (_("ended"), _("not yet") if ended is None else office.moment(ended)),
        (_("version of Sprag"), version("sprag-study")),
        (_("engine"), record.engine_version),
        (_("hash of the physics"), record.physics_hash),
        (_("SHA-256 of the spec"), spec_hash(spec)),
    )


def spec_hash(spec: Mapping[str, Any]) -> str:
    """SHA-256 of a spec as JSON in ASCII with sorted keys and without spaces."""
    text = json.dumps(spec, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _combined(study: Study) -> str:
    if study.plan is not None:
        return _("cases chosen in rounds")
    if not study.axes:
        return _("none")
    return _("every combination") if study.combine == "grid" else _("side by side")
