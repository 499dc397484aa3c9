"""A new study as a row of the database."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from sprag_study.service.storage.rows.case_keys import keys_of
from sprag_study.service.storage.stored_sentences import write_warnings
from sprag_study.service.storage.tables import LINE_BY_LINE
from sprag_study.worker import models
from sprag_study.worker.planning import planner_of
from sprag_study.worker.reuse import kin_hash

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.worker.chunking import Chunking
    from sprag_study.worker.study import Study


def study_row(
    spec: Mapping[str, Any], study: Study, chunking: Chunking, warnings: Sequence[str] = ()
) -> dict[str, Any]:
    """The columns of a new study that follow from the study itself, and the ``keys`` of its cases (`keys_of`).

    This takes about a second for a million values, so it is computed in the processes that check studies.
    """
    planner = None if study.plan is None else planner_of(study.plan)
    kin = kin_hash(study, models.ENGINE_VERSION)
    return {
        "name": study.name,
        "model": study.model,
        "variant": models.variant_of(study),
        "cases": study.cases,
        "chunk_cases": chunking.cases_of(study),
        "engine_version": models.ENGINE_VERSION,
        "physics_hash": study.physics_hash(models.ENGINE_VERSION),
        "spec": json.dumps(spec, allow_nan=False),
        "study": study.to_text(),
        "warnings": write_warnings(warnings),
        "kin_hash": kin,
        "keys": keys_of(study, kin),
        "coarse": 0 if study.sweep is None else LINE_BY_LINE,
        "most_cases": None if planner is None else planner.most_cases,
        "most_rounds": None if planner is None else planner.most_rounds,
    }
