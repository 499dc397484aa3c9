"""The estimated cost of a study before it is submitted."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.faults import warned
from sprag_study.service.reading.catalogue import axes_json
from sprag_study.service.results.fits import fit_json
from sprag_study.service.schedules.deadline import finish_warnings
from sprag_study.worker import models
from sprag_study.worker.chunking import work_of
from sprag_study.worker.planning import most_cases, planner_of

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import Preview
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.worker.chunking import Chunking
    from sprag_study.worker.study import Study

_FIRST_CASES = 5
#: Bytes of a row besides its results: key, case number, ending, flags and SQLite's header.
_ROW_BYTES = 48
_NUMBER_BYTES = 10


def estimated_bytes(study: Study) -> int:
    """Rough size of the results of ``study`` in the database, all rounds included."""
    return most_cases(study) * (_ROW_BYTES + _NUMBER_BYTES * len(models.study_results(study)))


def estimated_seconds(study: Study, chunking: Chunking, to_run: int) -> float:
    """Rough time (s) of running that many cases of ``study`` on the processes of ``chunking``, compilation included."""
    if not to_run:
        return 0.0
    # A study with fewer cases than processes still takes the time of one case.
    rounds = max(to_run / chunking.processes, 1.0)
    return work_of(rounds) * models.estimate_seconds_per_case(study) + models.estimate_compile_seconds(study)


def preview_json(
    parsed: ParsedSpec,
    chunking: Chunking,
    reusable: int = 0,
    seconds_left: float | None = None,
    start_seconds: float = 0.0,
) -> Preview:
    """The preview of ``parsed``, divided into chunks and run with ``chunking``, as JSON data.

    ``reusable`` of its cases need not be run, because other studies of the database have them. ``estimated_seconds``
    (elapsed time, including ``start_seconds`` of the pool and the compilation of kernels that are not cached) and
    ``estimated_bytes`` (in the database) are rough. A warning is added when ``seconds_left`` until a deadline will
    hardly suffice.
    """
    study = parsed.study
    most = most_cases(study)
    seconds = start_seconds + estimated_seconds(study, chunking, most - reusable)
    late = () if seconds_left is None else finish_warnings(study, seconds, seconds_left)
    first = range(min(_FIRST_CASES, study.cases))
    return {
        "model": study.model,
        "name": study.name,
        "cases": study.cases,
        "most_cases": most,
        "most_rounds": 1 if study.plan is None else planner_of(study.plan).most_rounds,
        "shape": list(study.shape),
        "combine": study.combine,
        "axes": axes_json(study),
        "derive": dict(study.derive),
        "results": len(models.study_results(study)),
        "reusable": reusable,
        "estimated_seconds": seconds,
        "estimated_bytes": estimated_bytes(study),
        **warned((*parsed.warnings, *chunking.warnings(study), *late)),
        "fits": {pointer: fit_json(fit) for pointer, fit in parsed.fits.items()},
        "first_cases": [
            {"case": case, "parameters": values} for case, values in zip(first, study.values_with(first), strict=True)
        ],
    }
