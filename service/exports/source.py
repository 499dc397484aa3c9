"""The source of an export: a study, its rows, and the meaning of each column."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.service.exports.inputs import choices, defaults
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.directions import value_columns
from sprag_study.service.reading.quantities import SI, Units, units_for
from sprag_study.service.spec.kinds.tolerances import SPREAD
from sprag_study.worker import models
from sprag_study.worker.ports import StoreError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from sprag_study.service.formats import Header
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import RowBlock, StudyRecord
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study


#: Parts of a spec that describe the machine and its run; the rows themselves contain the axes.
_GIVEN: Final = ("base", "derive", "run", "quantities", *SPREAD)


@dataclass(frozen=True, slots=True)
class Source:
    """The source of an export: a study, the description of its results, and its rows in order of cases.

    ``spec`` is the user's own, which contains the non-numeric inputs: kinds, formulas, tables, measured points.
    Tables are written in ``units``; the description of the machine is in SI. ``header`` says what heads the columns of
    CSV.
    """

    study: Study
    infos: tuple[ResultInfo, ...]
    blocks: Iterable[RowBlock]
    about: dict[str, Any]
    spec: Mapping[str, Any] = field(default_factory=dict)
    units: Units = field(default_factory=Units)
    header: Header = "names"

    def in_units(self) -> Source:
        """The source with results in the reader's units."""
        if not self.units.chosen:
            return self
        infos = tuple(replace(info, unit=self.units.unit(info.unit)) for info in self.infos)
        return replace(self, infos=infos, blocks=map(self._block, self.blocks))

    def _block(self, block: RowBlock) -> RowBlock:
        columns = [self.units.values(block.values[:, place], info.unit) for place, info in enumerate(self.infos)]
        return replace(block, values=np.stack(columns, axis=1) if columns else block.values)

    def parameters(self, cases: NDArray[np.int64]) -> dict[str, list[float] | list[str]]:
        """The parameters of cases in the reader's units: a list for each of the study's column paths."""
        columns = value_columns(self.study, cases)
        chosen = {path: unit_of(self.study, path) for path in columns if unit_of(self.study, path) in self.units.chosen}
        return columns | {path: self.units.values(np.array(columns[path]), si).tolist() for path, si in chosen.items()}

    def unit(self, path: str) -> str:
        """The unit of a parameter's column."""
        return self.units.unit(unit_of(self.study, path))


class MissingRowsError(StoreError):
    """The rows that were read of a study are not those that its record counts."""


@dataclass(frozen=True, slots=True)
class StoredRows:
    """The rows of a study of the database in order of cases, read anew and counted by each iteration.

    An iteration ends in MissingRowsError where it has not met every case that has ended. Of a study that changes in the
    meantime it has met at least those that had ended before and after.
    """

    store: Store
    study_id: str

    def __iter__(self) -> Iterator[RowBlock]:
        before, cases = self.store.studies.get(self.study_id), 0
        for block in self.store.rows.blocks(self.study_id):
            cases += int(np.count_nonzero(np.diff(block.cases, prepend=-1)))
            yield block
        after = self.store.studies.get(self.study_id)
        least = min(before.done, after.done)
        if cases < least or (before.revision == after.revision and cases != least):
            raise MissingRowsError(
                f"{least:,} cases of the study {self.study_id} have ended, and {cases:,} were read: ask again; if that "
                "does not help, `sprag admin db check` looks for the cause"
            )


def stored(store: Store, record: StudyRecord, study: Study, units: str = SI, header: Header = "names") -> Source:
    """The rows of a study of the database; raises SelectionError for ``units`` that cannot be shown."""
    store.digests.require_undamaged(record.id, anew=True)
    origins = store.rows.origins(record.id)
    about: dict[str, Any] = {
        "study": record.id,
        "name": record.name,
        "model": record.model,
        "engine_version": record.engine_version,
        "computed_by": [asdict(origin) for origin in origins],
    }
    if len({origin.fingerprint for origin in origins} - {None}) > 1 and (
        by := store.rows.cases_by_fingerprint(record.id)
    ):
        about["cases_by_fingerprint"] = [asdict(item) for item in by]
    spec = store.studies.spec(record.id)
    return Source(
        study,
        models.study_results(study),
        StoredRows(store, record.id),
        about,
        spec,
        units_for(study, spec, units),
        header,
    )


def machine(source: Source) -> dict[str, Any]:
    """The machine and its run for programs, plain JSON data.

    ``base`` and ``run`` in SI numbers, ``derive`` (formulas of derived parameters in SI numbers), ``choices``
    (non-numeric fields), ``defaults`` (paths that were left out), and ``given``, base, formulas, run and
    tolerances as the user wrote them.
    """
    study, spec = source.study, source.spec
    return {
        "base": study.base,
        "derive": study.derive,
        "choices": choices(study, spec),
        "run": study.run,
        "combine": study.combine,
        "given": given(spec),
        "defaults": defaults(study, spec),
    }


def given(spec: Mapping[str, Any]) -> dict[str, Any]:
    """The machine, its formulas, its run and its tolerances as the user wrote them, with their units: JSON data."""
    return {name: spec[name] for name in _GIVEN if spec.get(name) not in (None, {}, [])}


def given_texts(spec: Mapping[str, Any]) -> dict[str, str]:
    """The same, flat: ``base.mechanism.slider_crank.crank`` -> ``40 mm``; tables and lists as JSON text."""
    return {path: text for name, part in given(spec).items() for path, text in _flat(name, part)}


def _flat(path: str, value: object) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping) and value:
        for name, item in value.items():
            yield from _flat(f"{path}.{name}", item)
    elif isinstance(value, list) and any(isinstance(item, Mapping) for item in value):
        for index, item in enumerate(value):
            yield from _flat(f"{path}.{index}", item)
    else:
        text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
        yield path, text.encode("utf-8", "backslashreplace").decode()
