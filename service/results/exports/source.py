"""The source of an export: a study, its rows, and the meaning of each column."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from sprag.service.results.exports.inputs import choices, defaults
from sprag.service.spec.fields import TOLERANCE_FIELDS
from sprag.worker import models

if TYPE_CHECKING:
    from sprag.service.storage.records import RowBlock, StudyRecord
    from sprag.service.storage.store import Store
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study


#: Parts of a spec that describe the machine and its run; the rows themselves contain the axes.
_GIVEN: Final = ("base", "derive", "run", *TOLERANCE_FIELDS)


@dataclass(frozen=True, slots=True)
class Source:
    """The source of an export: a study, the description of its results, and its rows in order of cases.

    ``spec`` is the user's own, which contains the non-numeric inputs: kinds, formulas, tables, measured points.
    """

    study: Study
    infos: tuple[ResultInfo, ...]
    blocks: Iterable[RowBlock]
    about: dict[str, Any]
    spec: Mapping[str, Any] = field(default_factory=dict)


def stored(store: Store, record: StudyRecord, study: Study) -> Source:
    """The rows of a study of the database."""
    about = {"study": record.id, "name": record.name, "model": record.model, "engine_version": record.engine_version}
    return Source(study, models.study_results(study), store.iter_rows(record.id), about, store.spec(record.id))


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
