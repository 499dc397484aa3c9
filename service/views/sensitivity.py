"""What the results of a study depend on."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag.service import exports
from sprag.service.answers import results as m
from sprag.service.faults import warned
from sprag.service.figures.pictures.sensitivity import draw_sensitivity
from sprag.service.results.selection import numeric_results
from sprag.service.results.sensitivity import Sensitivity, sensitivity
from sprag.service.results.sensitivity_indices import Indices
from sprag.service.views.study_questions import SENSITIVITY, SensitivityQuestion
from sprag.service.views.study_view import StudyAnswer, StudyView
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from sprag.service.figures.pictures.curves import Picture
    from sprag.service.reading.reader import Reading
    from sprag.service.views.library import Library
    from sprag.worker.study import Study


class SensitivityView(StudyView[SensitivityQuestion, tuple[str, ...], list[Sensitivity]]):
    """Shares of the variance or elementary effects, and main effects."""

    about = SENSITIVITY
    content = "Effects, as JSON, a table of indices or a picture."
    shape = m.SensitivityReport

    def choose(self, study: Study, question: SensitivityQuestion) -> tuple[str, ...]:
        """The names of the results."""
        return tuple(dict.fromkeys(question.y))

    def check(self, study: Study, chosen: tuple[str, ...]) -> None:
        """The names of the results."""
        numeric_results(models.study_results(study), "y", chosen)

    def find(
        self, library: Library, study_id: str, chosen: tuple[str, ...], *, drawn: bool = False
    ) -> list[Sensitivity]:
        """The sensitivities; raises SelectionError and StudyNotFoundError."""
        store = library.store
        fetch = partial(store.rows.for_cases, study_id)
        return sensitivity(store.studies.study(study_id), store.studies.spec(study_id), list(chosen), fetch)

    def json(self, answer: StudyAnswer[tuple[str, ...], list[Sensitivity]]) -> Mapping[str, Any]:
        """The sensitivities as JSON data, with warnings of parameters without effect."""
        record = answer.library.store.studies.get(answer.study_id)
        warnings = warned(answer.library.unaffected.of(answer.library.store, record))
        return {"study": answer.study_id, "results": [item.to_json() for item in answer.result], **warnings}

    def csv(self, answer: StudyAnswer[tuple[str, ...], list[Sensitivity]], reading: Reading) -> bytes:
        """The indices."""
        return indices_csv(answer.result, reading)

    def picture(
        self, answer: StudyAnswer[tuple[str, ...], list[Sensitivity]], reading: Reading, title: str, form: Picture
    ) -> bytes:
        """Bars and lines."""
        return draw_sensitivity(answer.result, title, reading, form)


def sensitivities_shown(library: Library, study_id: str, names: Sequence[str]) -> list[m.ResultSensitivity]:
    """The sensitivities of these results as JSON data, for a page."""
    return [item.to_json() for item in SensitivityView().find(library, study_id, tuple(names))]


#: Indices in the unit of the result; the others are shares of its variance.
_IN_ITS_UNIT: Final = ("mu", "mu_star", "mu_star_error", "sigma")


def indices_csv(found: Sequence[Sensitivity], reading: Reading) -> bytes:
    """A row for each result and axis: the indices with the half widths of their intervals; then one for each pair.

    Elementary effects are in the reader's unit of their result, which ``unit`` names.
    """
    indices = [field.name for field in fields(Indices)]
    header = ["result", "paths", *indices, "other_paths", "second_order", "second_order_error"]
    header += ["unit", "method", "cases", "notes"]
    rows = []
    for item in found:
        unit = item.info.unit
        about = [reading.unit(unit), item.method, item.cases, "; ".join(item.notes)]
        names = [" ".join(effect.paths) for effect in item.effects]
        for name, effect in zip(names, item.effects, strict=True):
            own = [
                reading.value(getattr(effect.indices, index), unit if index in _IN_ITS_UNIT else "1")
                for index in indices
            ]
            rows.append([item.info.name, name, *own, None, None, None, *about])
        for pair in item.pairs:
            first, second, nothing = names[pair.first], names[pair.second], [None] * len(indices)
            rows.append([item.info.name, first, *nothing, second, pair.index, pair.error, *about])
    return exports.table_csv(header, zip(*rows, strict=True) if rows else [[] for _ in header])
