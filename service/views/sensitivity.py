"""What the results of a study depend on."""

from __future__ import annotations

from dataclasses import fields
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Amount, Name
from sprag_study.service import exports
from sprag_study.service.answers import results as m
from sprag_study.service.faults import warned
from sprag_study.service.figures.effects import effects_figure
from sprag_study.service.figures.pictures import MOST_RESULTS, draw_sensitivity
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.defaults import drawn_results, varying_axes
from sprag_study.service.results.selection import numeric_names, numeric_results
from sprag_study.service.results.sensitivity import Sensitivity, in_order, sensitivity
from sprag_study.service.results.sensitivity_indices import Indices
from sprag_study.service.views.branch import named
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.service.views.study_questions import SENSITIVITY, SensitivityQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from typing import Any

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.formats import Picture
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.sensitivity import Effect
    from sprag_study.service.views.library import Library
    from sprag_study.worker.study import Study


SensitivityAnswer = StudyAnswer[tuple[str, ...], list[Sensitivity]]


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

    def has(self, study: Study) -> bool:
        """Whether anything varies that was not chosen by the study itself."""
        return bool(varying_axes(study)) and study.plan is None

    def offered(self, study: Study) -> dict[str, Offered]:
        """The results that are numbers; first those that are drawn."""
        infos = models.study_results(study)
        return {"y": Offered(drawn_results(study)[:MOST_RESULTS], groups=named(numeric_names(infos)))}

    def find(self, library: Library, study_id: str, chosen: tuple[str, ...]) -> list[Sensitivity]:
        """The sensitivities; raises SelectionError and StudyNotFoundError."""
        store = library.store
        fetch = partial(store.rows.for_cases, study_id)
        return sensitivity(store.studies.study(study_id), store.studies.spec(study_id), list(chosen), fetch)

    def json(self, answer: SensitivityAnswer) -> Mapping[str, Any]:
        """The sensitivities as JSON data, with warnings of parameters without effect."""
        record = answer.library.store.studies.get(answer.study_id)
        warnings = warned(answer.library.unaffected(record))
        return {"study": answer.study_id, "results": [item.to_json() for item in answer.result], **warnings}

    def shown(self, answer: SensitivityAnswer) -> Shown:
        """How they were found, and the shares or effects of each axis."""
        return Shown(
            tuple(_about(item) for item in answer.result), tuple(t for item in answer.result for t in _tables(item))
        )

    def figure(self, answer: SensitivityAnswer, columns: int = 2) -> Figure:
        """The mean of each result along each axis, what matters most first."""
        return effects_figure(answer.result, columns)

    def csv(self, answer: SensitivityAnswer, reading: Reading) -> bytes:
        """The indices."""
        return indices_csv(answer.result, reading)

    def picture(self, answer: SensitivityAnswer, reading: Reading, title: str, form: Picture) -> bytes:
        """Bars and lines."""
        return draw_sensitivity(answer.result, title, reading, form)


#: Methods by which indices were found, in words.
_METHODS: Final = {
    "grid": N_("exact sums over a full grid"),
    "saltelli": N_("estimated from the design for Sobol indices"),
    "morris": N_("elementary effects of trajectories (Morris)"),
    "rbd-fast": N_("estimated from a sample"),
    "none": N_("no shares of the variance"),
}


def _about(item: Sensitivity) -> Phrase:
    """How the indices of a result were found, and what to know about them."""
    mean = [] if item.mean is None else [Phrase("mean {value}", value=Amount(item.mean, item.info.unit))]
    parts = [Phrase(_METHODS[item.method]), *mean, *item.notes]
    return plural(
        "{name}: {count} case, {parts}.", "{name}: {count} cases, {parts}.", item.cases,
        name=Name(item.info.name), parts=joined("; ", parts),
    )  # fmt: skip


def _named(effect: Effect) -> Phrase:
    """What an effect is of: the paths that vary together."""
    return joined(" = ", map(Name, effect.paths))


def _tables(item: Sensitivity) -> Iterator[ShownTable]:
    """The indices of a result, and its interactions."""
    if item.method == "none":
        return
    name = Name(item.info.name, within=True)
    columns: tuple[Column, ...]
    if item.method == "morris":
        title, unit = Phrase("Elementary effects on {name}", name=name), item.info.unit
        columns = tuple(Column(Phrase(text), unit, 3) for text in ("μ", "μ*", "±", "σ"))
        values: tuple[str, ...] = ("mu", "mu_star", "mu_star_error", "sigma")
    else:
        title = Phrase("Shares of the variance of {name}", name=name)
        columns = tuple(
            Column(Phrase(text), models.SHARE, 3)
            for text in (N_("Alone"), "±", N_("With what it does together with others"), "±")
        )
        values = ("first_order", "first_order_error", "total", "total_error")
    names = [_named(effect) for effect in item.effects]
    rows = [[_named(effect), *(getattr(effect.indices, value) for value in values)] for effect in in_order(item)]
    yield ShownTable(title, (Column(Phrase("Parameter")), *columns), rows)
    if item.pairs:
        pairs = [[names[pair.first], names[pair.second], pair.index, pair.error] for pair in item.pairs]
        heads = (
            Column(Phrase("Parameter")),
            Column(Phrase("with")),
            Column(Phrase("Share"), models.SHARE, 3),
            Column(Phrase("±"), models.SHARE, 2),
        )
        yield ShownTable(Phrase("Interactions of two, on {name}", name=name), heads, pairs)


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
