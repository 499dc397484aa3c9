"""The headline of a study: the answer in a sentence or two and up to four key numbers, whatever kind of study it is.

The page of a study, the list of studies, the document and the mails of nights tell it from here.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.sentences import Amount, Name
from sprag_study.service.faults import SelectionError
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.service.results.choice import characteristic
from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.headlines.along import along_headline
from sprag_study.service.results.headlines.batch import asked_like, batch_headline
from sprag_study.service.results.headlines.calibrated import calibrated_headline
from sprag_study.service.results.headlines.headline import Headline, KeyNumber, Trace, amount, digits
from sprag_study.service.results.headlines.search import search_headline
from sprag_study.service.results.key_answers import answers_query
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.sweeps import hysteresis
from sprag_study.service.storage.database.session import in_one_moment
from sprag_study.service.views.answers import answers_in, overall_in
from sprag_study.service.views.relatives import asked_by
from sprag_study.service.views.study_view import FEW
from sprag_study.worker import models
from sprag_study.worker.states import StudyState

if TYPE_CHECKING:
    from sprag_study.service.results.curves import CurveQuery
    from sprag_study.service.storage.studies.records import CaseColumns, Progress, StudyRecord
    from sprag_study.service.views.library import Library
    from sprag_study.worker.planning.refine_plan import RefinePlan
    from sprag_study.worker.study import Study

__all__ = ["Headline", "KeyNumber", "Trace", "headline_of", "is_small", "usual_query"]


def is_small(study: Study) -> bool:
    """Whether the service itself may find the headline; otherwise it takes long, and another process does.

    Designs are ranked and drives are counted in a time that grows faster than their number.
    """
    return study.cases <= FEW // (2 if asked_by(study) == "along" else 10)


def headline_of(
    library: Library,
    study_id: str,
    query: CurveQuery | None = None,
    point: str | None = None,
    curve: str = "",
) -> Headline:
    """The headline of a study, all of one moment.

    Parameters
    ----------
    query : the curves that it is about; by default those of the page
    point : the working point, a text with or without a unit; between two cases both of them are told
    curve : the name of the curve among several; by default that nearest to the machine of the base

    Raises
    ------
    StudyNotFoundError, SelectionError
    """
    return in_one_moment(_headline, library, study_id, query, point, curve)


def _headline(library: Library, study_id: str, query: CurveQuery | None, point: str | None, curve: str) -> Headline:
    (record, progress), study = library.store.studies.look(study_id), library.store.studies.study(study_id)
    if not progress.done:
        return Headline((_not_begun(record),))
    if not progress.ok:
        return Headline((_nothing_ok(progress),))
    key = study_id, record.revision, query, point, curve
    found = library.told.of(key, lambda: _of_cases(library, study_id, study, record, query, point, curve))
    sentence = found.sentence or (
        Phrase("There is no answer yet.") if not record.over else Phrase("There is no answer."),
    )
    if not record.over and record.state is not StudyState.FAILED:
        sentence = *sentence, _so_far(progress)
    return replace(found, sentence=sentence)


def _not_begun(record: StudyRecord) -> Phrase:
    """The sentence of a study without a row."""
    texts = {
        StudyState.QUEUED: Phrase("It waits for its turn; no case has been run yet."),
        StudyState.RUNNING: Phrase("The first cases are being run."),
        StudyState.PAUSED: Phrase("It is held before its first case."),
        StudyState.CANCELLED: Phrase("It was cancelled before its first case."),
    }
    return texts.get(record.state, Phrase("No case has been run."))


def _nothing_ok(progress: Progress) -> Phrase:
    """The sentence of a study none of whose cases has ended well, with the most frequent ending."""
    ending = max(progress.endings, key=lambda name: progress.endings[name])
    return plural(
        "The case that was run has no result: {ending}.",
        "None of {count} cases has a result: {ending}.",
        progress.done, ending=term(ending),
    )  # fmt: skip


def _so_far(progress: Progress) -> Phrase:
    return plural(
        "So far {done} of {count} case is run.", "So far {done} of {count} cases are run.",
        progress.total, done=progress.done,
    )  # fmt: skip


def _of_cases(
    library: Library,
    study_id: str,
    study: Study,
    record: StudyRecord,
    query: CurveQuery | None,
    point: str | None,
    curve: str,
) -> Headline:
    """The headline of what has been run."""
    kind = asked_by(study)
    if kind == "best":
        return search_headline(library.fronts.of(study_id, exact=False), over=record.over)
    if kind == "measured":
        return calibrated_headline(library.calibrations.of(study_id))
    fetch = partial(library.store.rows.for_cases, study_id)
    if study.batched and query is None:
        return batch_headline(study, asked_like(usual_query(library, study_id)), point, fetch)
    mapped = map_plan(study)
    if mapped is not None and query is None:
        return _of_map(study, mapped, fetch(np.arange(study.cases, dtype=np.int64), mapped.results))
    asked = answers_query(study, query or usual_query(library, study_id))
    found = answers_in(library, study_id, asked, None if asked is None else point)
    if asked is None:
        found = replace(found, overall=overall_in(library, study_id))
    told = along_headline(study, found, curve, asked=bool(point))
    if study.sweep is not None and found.drawn is not None and (text := hysteresis(found.drawn)):
        told = replace(told, sentence=(*told.sentence[:1], joined("", [text])))
    return told


def _of_map(study: Study, plan: RefinePlan, columns: CaseColumns) -> Headline:
    """The least and the largest value of the first result of a refined map, with their places."""
    name = plan.results[0]
    info = next(one for one in models.study_results(study) if one.name == name)
    usable = models.usable(study.model, columns.endings, columns.flags, name)
    values = np.where(usable, columns.values[name], np.nan)
    if not np.isfinite(values).any():
        return Headline()
    paths = [axis.paths[0] for axis in plan.adaptive]
    numbers = []
    named = Name(name, within=True)
    for label, place in (
        (Phrase("Largest {name}", name=named), int(np.nanargmax(values))),
        (Phrase("Smallest {name}", name=named), int(np.nanargmin(values))),
    ):
        value, own = float(values[place]), study.case_parameters(place)
        x, y = (Amount(own[path], unit_of(study, path), 4) for path in paths)
        where = Phrase("at {x} and {y}", x=x, y=y)
        numbers.append(KeyNumber(label, value, info.unit, digits(value), where=where, case=place))
    ends = {
        "low": amount(info, float(np.nanmin(values))),
        "high": amount(info, float(np.nanmax(values))),
    }
    text = Phrase("Over the map {name} reaches from {low} to {high}.", name=named, **ends)
    return Headline((text,), tuple(numbers))


def usual_query(library: Library, study_id: str) -> CurveQuery | None:
    """The curves that are shown first; where they have no finished case, held where there are finished cases."""
    store = library.store
    study = store.studies.study(study_id)
    query = characteristic(study)
    if query is None or not query.at or store.studies.get(study_id).state is StudyState.FINISHED:
        return query
    try:
        cases = [line.cases for line in select(study, query).lines]
    except SelectionError:
        return query
    found = store.rows.for_cases(study_id, np.concatenate(cases), ())
    done = store.rows.block(study_id, limit=1).cases
    if not {None, models.WorkerEnding.CANCELLED}.issuperset(found.endings) or not len(done):
        return query
    # Of a parameter with a tolerance, the axis has the nominal value.
    places = [(study.axes[axis], index) for axis, index in enumerate(study.indices(done[:1]))]
    values = {path: axis.value(int(index[0])) for axis, index in places for path in axis.paths}
    return replace(query, at=tuple((path, repr(values[path])) for path, _ in query.at))
