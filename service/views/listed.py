"""What a list tells of each study: what it is in words, up to three answers and a line for a thumbnail.

A headline takes a tenth of a second and is kept by the revision of its study, so a list of fifty is quick once it has
been looked at: each look finds as many more as its time allows, and shows the others without answers until then.
"""

from __future__ import annotations

import time
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Name
from sprag_study.service.faults import FaultError
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, Reading
from sprag_study.service.results.choice import characteristic
from sprag_study.service.storage.errors import StoreError
from sprag_study.service.views.headline import headline_of, is_small
from sprag_study.service.views.library import reading_of
from sprag_study.service.views.relatives import asked_by

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from sprag_study.service.reading.reader import Choice
    from sprag_study.service.results.headlines.headline import Headline
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

#: Answers of a row.
ANSWERS: Final = 3
_GOAL: Final = N_("the best design")
_CALIBRATION: Final = N_("parameters that fit a measurement")
_BATCH: Final = N_("what tolerances do")


@dataclass(frozen=True, slots=True)
class Listed:
    """What a list tells of a study."""

    headline: Headline
    about: Phrase
    reading: Reading


def listed(library: Library, records: Iterable[StudyRecord], choice: Choice, seconds: float) -> dict[str, Listed]:
    """What is known of the studies; of those that have changed, as many as ``seconds`` allow.

    A study that runs keeps the headline that it had until there is time for another.
    """
    found = {}
    for record, told in _looked_at(library, records, seconds):
        with suppress(StoreError):  # deleted or damaged meanwhile
            if told is not None:
                found[record.id] = Listed(*told, reading_of(library.store, record.id, choice))
    return found


def known(library: Library, records: Iterable[StudyRecord], seconds: float) -> list[bool]:
    """Which of the studies have an answer after another look, for a stream of changes."""
    return [told is not None for _record, told in _looked_at(library, records, seconds)]


def _looked_at(
    library: Library, records: Iterable[StudyRecord], seconds: float
) -> Iterator[tuple[StudyRecord, tuple[Headline, Phrase] | None]]:
    """The studies with their headlines, and what they are, where that is known after another look."""
    kept, until = library.headlines, time.monotonic() + seconds
    for record in records:
        known = kept.get(record.id)
        if (known is None or known[0] != record.revision) and record.done and time.monotonic() < until:
            known = kept.put(record.id, (record.revision, _headline(library, record.id)))
        yield record, None if known is None else known[1]


def _headline(library: Library, study_id: str) -> tuple[Headline, Phrase] | None:
    """The headline, and what the study is; None where it is deleted, damaged, or takes long."""
    try:
        study = library.store.studies.study(study_id)
        return (headline_of(library, study_id), about(study)) if is_small(study) else None
    except (FaultError, StoreError):
        return None


def about(study: Study) -> Phrase:
    """What a study is, in words: ``mean shaft speed along load torque``."""
    asked = asked_by(study)
    if asked == "best":
        return Phrase(_GOAL)
    if asked == "measured":
        return Phrase(_CALIBRATION)
    if asked == "tolerances":
        return Phrase(_BATCH)
    query = characteristic(study)
    if query is None:
        return Phrase("")
    return Phrase("{name} along {path}", name=Name(query.y[0], within=True), path=Name(query.x, within=True))
