"""Varied parameters that change no result: found by comparing cases that differ in nothing else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Place, Sentence, WarningText
from sprag_study.service.results.curves import Fetch
from sprag_study.service.results.tolerances.batch import nominal_only
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.arrays import Ints
    from sprag_study.worker.study import Study

#: Most cases that are compared for one axis.
MOST_CASES: Final = 5_000
#: Largest study with zipped axes, in cases, that is examined.
MOST_ROWS: Final = 200_000
#: Results with a smaller relative difference count as equal, apart from rounding.
_SAME: Final = 1e-9
#: First parts of the names of results that describe the computation rather than the machine.
_CHECKS: Final = ("balance", "run", "reset")


def unaffected(study: Study, fetch: Fetch) -> tuple[str, ...]:
    """A sentence for each axis that changes no result in any of the many cases compared."""
    study, fetch = nominal_only(study, fetch)
    infos = models.study_results(study)
    names = [info.name for info in infos if info.name.split(".")[0] not in _CHECKS]
    found = []
    for position, axis in enumerate(study.axes):
        looked = 0
        for groups in _groups(study, position):
            if _changes(groups, names, fetch):
                looked = 0
                break
            looked += sum(map(len, groups))
        if looked:
            text = (
                Sentence("was varied, but changes no result in any case")
                if looked >= study.cases
                else Sentence(
                    "was varied, but changes no result in any of {count} cases that were compared", count=looked
                )
            )
            found.append(WarningText(text, "no-effect").at(Place(f"/axes/{position}", " = ".join(axis.paths))))
    return tuple(found)


def _groups(study: Study, position: int) -> Iterator[list[Ints]]:
    """Cases that differ in one axis only, group by group: few at first, then more, to the limit."""
    lines = _grid_lines(study, position) if study.combine == "grid" else _table_groups(study, position)
    at, looked = 0, 0
    size = 1
    while at < len(lines) and looked < MOST_CASES:
        part = lines[at : at + size]
        yield part
        looked += sum(map(len, part))
        at, size = at + size, size * 8


def _grid_lines(study: Study, position: int) -> list[Ints]:
    """Lines along the axis, spread evenly over the grid."""
    length = len(study.axes[position])
    if length < 2:
        return []
    stride = int(np.prod(study.shape[position + 1 :], dtype=np.int64))
    lines = study.cases // length
    chosen = np.unique(np.linspace(0, lines - 1, min(lines, max(1, MOST_CASES // length)), dtype=np.int64))
    starts = chosen // stride * (stride * length) + chosen % stride
    steps = np.unique(np.linspace(0, length - 1, min(length, MOST_CASES), dtype=np.int64))
    return [start + steps * stride for start in starts]


def _table_groups(study: Study, position: int) -> list[Ints]:
    """Cases of a table that are equal in everything but one axis."""
    if study.cases > MOST_ROWS or len(study.axes) < 2:
        return []
    others = np.stack([axis.array for index, axis in enumerate(study.axes) if index != position], axis=1)
    _, member, count = np.unique(others, axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(member.reshape(-1), kind="stable")
    parts = np.split(order, np.cumsum(count)[:-1])
    return [part.astype(np.int64) for part in parts if part.size > 1][:MOST_CASES]


def _changes(groups: Sequence[Ints], names: Sequence[str], fetch: Fetch) -> bool:
    """Whether any result or ending differs within any group; an unfinished case counts as different."""
    columns = fetch(np.concatenate(groups), names)
    table = np.stack([columns.values[name] for name in names], axis=1)
    start = 0
    for group in groups:
        part = slice(start, start + len(group))
        endings = set(columns.endings[part])
        rows = table[part]
        if len(endings) > 1 or None in endings:
            return True
        if not np.isclose(rows, rows[:1], rtol=_SAME, atol=0.0, equal_nan=True).all():
            return True
        start = part.stop
    return False


def unaffecting(store: Store, record: StudyRecord) -> tuple[str, ...]:
    """The sentences about the axes of a stored study that has ended with rows."""
    return unaffected(store.studies.study(record.id), partial(store.rows.for_cases, record.id))
