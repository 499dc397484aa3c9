"""The relatives of a study: studies of the same machine, or of one that differs from it in a few numbers.

Clones and variants are such studies, whoever made them and when: what they have in common is their machine.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

from sprag_study.sentences import Amount, Name
from sprag_study.service.answers.studies import StudyOrder
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.storage.studies.listing import StudyFilter
from sprag_study.worker import models
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.goals.plan import GOAL
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study

#: What a study asks of its machine: how it runs, which design is best, what tolerances do, what a measurement says.
Asked = Literal["along", "best", "tolerances", "measured"]
#: Studies of the model that are looked at, the latest ones.
_LOOKED_AT: Final = 40
#: Numbers in which a relative differs at most.
_MOST: Final = 3


@dataclass(frozen=True, slots=True)
class Relative:
    """A study with what it asks, and the numbers of its machine that differ, by path (SI)."""

    record: StudyRecord
    study: Study
    asked: Asked
    differs: Mapping[str, float]

    @property
    def title(self) -> Phrase | None:
        """What differs, such as "arm 36 mm"; None where nothing does."""
        parts = (
            Phrase("{name} = {value}", name=Name(path, within=True), value=Amount(value, unit_of(self.study, path), 4))
            for path, value in self.differs.items()
        )
        return joined(", ", parts) if self.differs else None


def asked_by(study: Study) -> Asked:
    """What a study asks."""
    if study.kind == GOAL:
        return "best"
    if study.kind == CALIBRATE:
        return "measured"
    return "along" if study.spread is None else "tolerances"


def relatives_of(library: Library, study_id: str) -> tuple[Relative, ...]:
    """The relatives of a study with a row, the latest first, without itself; raises StudyNotFoundError."""
    study = library.store.studies.study(study_id)
    listed = library.store.studies.page(_LOOKED_AT, None, StudyFilter(model=study.model), StudyOrder.NEWEST)
    found = []
    for record in listed.studies:
        if record.id == study_id or not record.ok:
            continue
        other = library.store.studies.study(record.id)
        differs = differing_numbers(study, other)
        if differs is not None:
            found.append(Relative(record, other, asked_by(other), differs))
    return tuple(found)


def what_differs(studies: Sequence[Study]) -> tuple[str, ...]:
    """The few numbers of the machines in which studies differ, by path; () where they are no relatives."""
    differing = [differing_numbers(studies[0], other) for other in studies[1:]]
    paths = tuple(dict.fromkeys(path for found in differing for path in found or ()))
    free = {path for study in studies for path in (*study.axis_paths, *study.derive)}
    if None in differing or len(paths) > _MOST or not free.isdisjoint(paths):
        return ()
    return paths


def differing_numbers(study: Study, other: Study) -> dict[str, float] | None:
    """The numbers of another machine that differ from this one's; None where it is no relative.

    What varies in either study has no number of its own there, and what is derived follows from the others.
    """
    if study.base.keys() != other.base.keys() or study.structure != other.structure:
        return None
    if models.variant_of(study) != models.variant_of(other):
        return None
    free = {*study.axis_paths, *other.axis_paths, *study.derive, *other.derive}
    found = {
        path: value
        for path, value in other.base.items()
        if path not in free and abs(value - study.base[path]) > SAME_VALUE * max(abs(value), abs(study.base[path]))
    }
    return found if len(found) <= _MOST else None
