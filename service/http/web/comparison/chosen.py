"""What an address compares: its studies, what they have in common, and the choices of curves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.service.answers.differing import MOST_COMPARED, common_axes, unique_names
from sprag_study.service.faults import SelectionError, refused
from sprag_study.service.http.web.sheet.chart import results_of
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.limits import at_most
from sprag_study.service.reading.part_names import lower_first
from sprag_study.service.results.choice import held
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.curves import CurveQuery, Curves
from sprag_study.service.results.defaults import main_query
from sprag_study.service.results.differences import differences
from sprag_study.service.results.selection import value_of
from sprag_study.service.views.relatives import asked_by, what_differs
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.datastructures import QueryParams

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study


@dataclass(frozen=True, slots=True)
class Comparison:
    """A comparison of curves: the studies, what they have in common, and the choices.

    Attributes
    ----------
    x, y, by, at : of the curves of each study, as of `CurveQuery`
    of : values of ``by`` that have a curve, as "path=value"; all, where there are none
    shown : ids of the studies whose curves are drawn; all, where there are none
    less : id of the study from which the others differ; "" where the curves themselves are drawn
    """

    records: list[StudyRecord]
    studies: list[Study]
    axes: list[str]
    results: list[ResultInfo]
    x: str
    y: tuple[str, ...]
    by: tuple[str, ...] = ()
    at: tuple[str, ...] = ()
    of: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()
    less: str = ""

    def query(self, position: int) -> CurveQuery:
        """The curves of one study; axes that only it has are held at their usual value."""
        study = self.studies[position]
        given = [item for item in self.at if study.axis_of(item.partition("=")[0]) is not None]
        of = tuple(pair for item in self.of if (pair := self._value(study, item)) is not None)
        return CurveQuery(self.x, self.y, self.by, held(study, given, (self.x, *self.by)), of=of)

    def _value(self, study: Study, item: str) -> tuple[str, str] | None:
        """A value that tells curves apart; None where the study has no such case."""
        path, _, text = item.partition("=")
        if path not in self.by or study.axis_of(path) is None:
            return None
        value = value_of(path, text, unit_of(study, path), "of")
        return (path, text) if study.axis_with(path).index_of(value) is not None else None

    def pairs(self) -> list[tuple[str, str]]:
        """The comparison as parameters of a URL."""
        several = {"y": self.y, "by": self.by, "at": self.at, "of": self.of, "show": self.shown}
        return [
            *(("study", record.id) for record in self.records),
            ("x", self.x),
            *((name, value) for name, values in several.items() for value in values),
            *([("less", self.less)] if self.less else []),
        ]

    def held(self) -> list[tuple[str, ...]]:
        """What is held of each study. Raises SelectionError for choices that it does not have."""
        pairs = enumerate(self.studies)
        return [select(study, self.query(place)).held for place, study in pairs]


def chosen_studies(store: Store, given: QueryParams) -> list[StudyRecord]:
    """The studies of a URL; SelectionError where there is none or too many, StudyNotFoundError for unknown ones."""
    ids = list(dict.fromkeys(name for name in given.getlist("study") if name))
    if len(ids) > MOST_COMPARED:
        allowed = at_most(MOST_COMPARED)
        raise refused("study", "too-many", "too many studies are compared at once", len(ids), allowed=allowed)
    if not ids:
        raise refused(
            "study", "required", "is missing", allowed=Sentence("1 to {high} ids of studies", high=MOST_COMPARED)
        )
    return [store.studies.get(study_id) for study_id in ids]


def comparison(store: Store, given: QueryParams, records: list[StudyRecord]) -> Comparison:
    """The comparison of a URL, whose studies are ``records``; SelectionError where they have nothing in common."""
    studies = [store.studies.study(record.id) for record in records]
    axes = common_axes([[(axis.paths, len(axis)) for axis in study.axes] for study in studies])
    if any(asked_by(study) in ("best", "measured") for study in studies):  # their cases lie on no curves
        axes = []
    # Quantities of one name may be of different dimensions.
    known = [{(info.name, info.unit) for info in models.study_results(study)} for study in studies]
    infos = models.study_results(studies[0])
    results = [info for info in infos if all((info.name, info.unit) in own for own in known)]
    if not axes or not results:
        raise refused("study", "nothing-in-common", _nothing_in_common(studies, some_axis=bool(axes)))
    main = main_query(studies[0])
    x = given.get("x") or (main.x if main and main.x in axes else axes[0])
    by = tuple(path for path in given.getlist("by") if path and path != x)
    at = tuple(item for item in given.getlist("at") if item.partition("=")[2].strip())
    of = tuple(item for item in given.getlist("of") if item.partition("=")[0] in by)
    ids, less = [record.id for record in records], given.get("less", "")
    if less and (len(records) < 2 or less not in ids):
        raise refused("less", "invalid-choice", "is none of the compared studies", less)
    if less:
        results = [info for info in results if info.kind != "category"]
    y = results_of(studies[0], tuple(results), given)[0]
    y = tuple(name for name in y if any(info.name == name for info in results)) or (results[0].name,)
    shown = tuple(study_id for study_id in dict.fromkeys(given.getlist("show")) if study_id in ids)
    return Comparison(records, studies, axes, results, x, y, by, at, of, shown, less)


def _nothing_in_common(studies: Sequence[Study], *, some_axis: bool) -> str:
    if len({study.model for study in studies}) > 1:
        return N_("these studies are of different models, so that they have no result in common")
    if some_axis:
        return N_("these studies have no result in common against which to draw results")
    return N_("these studies have no varying parameter in common against which to draw results")


def labels(records: Sequence[StudyRecord]) -> list[str]:
    """Names of studies that tell them apart."""
    return unique_names([record.name for record in records], [record.id for record in records])


def short_names(studies: Sequence[Study], records: Sequence[StudyRecord], reading: Reading) -> list[str]:
    """What tells studies apart: the few numbers in which their machines differ, ``mass 0.5 kg``, or their names."""
    paths = what_differs(studies) if len(studies) > 1 else ()
    captions = [lower_first(reading.caption(path)) for path in paths]
    names = [
        ", ".join(f"{text} {_value(study, path, reading)}" for text, path in zip(captions, paths, strict=True))
        for study in studies
    ]
    return names if len(set(names)) == len(names) and all(names) else labels(records)


def curve_names(studies: Sequence[Study], records: Sequence[StudyRecord], reading: Reading) -> list[str]:
    """As `short_names`, the value alone where one number tells all studies apart."""
    path = told_apart_by(studies)
    return [_value(study, path, reading) for study in studies] if path else short_names(studies, records, reading)


def told_apart_by(studies: Sequence[Study]) -> str:
    """The only number in which studies differ, in each of them another one; "" where there is none."""
    paths = what_differs(studies) if len(studies) > 1 else ()
    values = {study.base[path] for study in studies for path in paths}
    return paths[0] if len(paths) == 1 and len(values) == len(studies) else ""


def _value(study: Study, path: str, reading: Reading) -> str:
    return reading.quantity(study.base[path], unit_of(study, path), 4)


def drawn(store: Store, chosen: Comparison, names: Sequence[str]) -> list[tuple[str, Curves]]:
    """The curves of every study by its name; SelectionError names the study at fault."""
    found = []
    for position, (record, study) in enumerate(zip(chosen.records, chosen.studies, strict=True)):
        try:
            selection = select(study, chosen.query(position))
        except SelectionError as error:
            faults = [replace(item, message=f"{names[position]}: {item.message}") for item in error.faults]
            raise SelectionError(faults) from error
        found.append((names[position], draw(selection, partial(store.rows.for_cases, record.id))))
    if chosen.less:
        return differences(found, [record.id for record in chosen.records].index(chosen.less))
    return found
