"""The branch of a case's motion along a parameter: what is asked for, the document, and the table as CSV."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Sentence, Typed
from sprag_study.service.answers import filled
from sprag_study.service.answers.results import Branch, BranchContact
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import choice_of, parameter_error
from sprag_study.service.figures.branch import OwnCases, branch_figure, special_text
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, plural
from sprag_study.service.reading.units import QuantityError, typed_value
from sprag_study.service.results.selection import axis_name, ends_of_range
from sprag_study.service.views.case_questions import BRANCH, BranchQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView, Said
from sprag_study.service.views.portrait import Strobed, require_settling, require_strobes
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Shown
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.models.abilities import branch_results, run_branch
from sprag_study.worker.models.branches import Along, CaseBranch
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.parameters import allowed_values
from sprag_study.worker.models.vibration_drive.start_states import is_initial

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

#: What stands in the empty fields of a range.
ENDS_OFFERED: Final = {"from": Offered(hint=N_("start of its axis")), "to": Offered(hint=N_("end of its axis"))}
_OUTSIDE = N_("outside the range of the parameter")


def ranged_axes(study: Study, *, initial: bool = False) -> list[str]:
    """Paths of the axes along which a case can be followed, with the initial values if ``initial``."""
    axes = [axis for axis in study.axes if study.beside.isdisjoint(axis.paths) and np.ptp(axis.array) > 0.0]
    return [axis.paths[0] for axis in axes if initial or not any(map(is_initial, axis.paths))]


def free_parameters(study: Study, case: int, *, initial: bool = False) -> list[str]:
    """Paths of the parameters of a case that can be changed alone, with the initial values if ``initial``."""
    own = case_machine(study, case)
    return [path for path in own if path not in study.derive and (initial or not is_initial(path))]


def usual_along(study: Study) -> str:
    """The parameter along which a branch is usually followed: the first axis with a range; "" where there is none."""
    wanted = ranged_axes(study)
    return next((path for path in models.presentation_of(study).along if path in wanted), wanted[0] if wanted else "")


def along_offered(study: Study, case: int, *, initial: bool = False) -> Offered:
    """The parameters along which a case can be followed, axes first; with the initial values if ``initial``."""
    axes = {path: axis_name(study, path) for path in ranged_axes(study, initial=initial)}
    on_axes = {path for name in axes.values() for path in name.split(" = ")}
    others = [path for path in free_parameters(study, case, initial=initial) if path not in on_axes]
    groups = {_("Axes of the study"): list(axes.items()), _("Other parameters"): [(path, path) for path in others]}
    return Offered(tuple(filter(None, (usual_along(study),))), groups=groups)


def named(names: Iterable[str]) -> dict[str, list[tuple[str, str]]]:
    """Names of quantities to choose from, in one group."""
    return {"": [(name, name) for name in names]}


def along_of(study: Study, case: int, along: str, low: str | None = None, high: str | None = None) -> Along:
    """The parameter of a branch and its range; as `range_of`, and FaultError about an initial value."""
    for path in (part.strip() for part in along.split(",")):
        axis = study.axis_of(path)
        if any(map(is_initial, (path,) if axis is None else study.axes[axis].paths)):
            raise parameter_error(
                "along", "conflict", "is an initial value: a periodic motion does not depend on how it began", path,
                ", ".join(free_parameters(study, case)),
            )  # fmt: skip
    return range_of(study, case, along, low, high, initial=False)


def range_of(
    study: Study, case: int, along: str, low: str | None = None, high: str | None = None, *, initial: bool = True
) -> Along:
    """The parameter along which a case is followed, and its range.

    Parameters
    ----------
    study : Study
    case : int
    along : str
        A path of a spec, or several joined by commas, which all get one value. All paths of an axis belong together.
    low, high : str, optional
        SI numbers or quantities with a unit; by default the ends of the axis.
    initial : bool
        Whether an initial value may be the parameter.

    Raises
    ------
    FaultError
        About the parameters ``along``, ``from`` or ``to``, because the machine has no strobes, or because the case does
        not settle.
    """
    require_strobes(study)
    own = case_machine(study, case)
    paths: list[str] = []
    for path in filter(None, (part.strip() for part in along.split(","))):
        if path not in own or path in study.derive:
            raise parameter_error(
                "along", "unknown-name",
                "is derived from others" if path in study.derive else "is not a numeric parameter of the study",
                path, ", ".join(free_parameters(study, case, initial=initial)),
            )  # fmt: skip
        axis = study.axis_of(path)
        paths += [path] if axis is None else study.axes[axis].paths
    if not paths:
        raise parameter_error("along", "required", "a branch needs a parameter", along, "the path of a parameter")
    paths = list(dict.fromkeys(paths))
    require_settling(own, tuple(paths))
    value = own[paths[0]]
    for path in paths:
        if own[path] != value:
            message = Sentence(
                "{path} has another value in case {case} than {first}", path=path, case=str(case), first=paths[0]
            )
            raise parameter_error("along", "conflict", message, along, f"{value!r}")
    ends = _axis_ends(study, paths[0])
    unit = unit_of(study, paths[0])
    low, high = ends_of_range(("from", "to"), low, high, unit)
    first = _value("from", low, unit, None if ends is None else ends[0])
    last = _value("to", high, unit, None if ends is None else ends[1])
    least, most = allowed_values(study, tuple(paths))
    for name, number, text in (("from", first, low), ("to", last, high)):
        if not least <= number <= most:
            limits = {"low": Amount(least, digits=6), "high": Amount(most, digits=6)}
            raise parameter_error(name, "out-of-range", _OUTSIDE, text, Sentence("{low} .. {high}", **limits))
    if not first <= value <= last or first == last:
        parts = {"first": Amount(first, digits=6), "last": Amount(last, digits=6), "value": Amount(value, digits=6)}
        message = Sentence("the range {first} .. {last} must contain the value of the case, {value}", **parts)
        raise parameter_error("from", "invalid-range", message, low, f"from <= {value:g} <= to")
    return Along(tuple(paths), first, last)


def result_of(study: Study, name: str | None) -> str:
    """The result that a picture shows, by default the first main one; FaultError about ``y`` for an unknown one."""
    known = branch_results(study)
    if name is None or not name.strip():
        drawn = (*models.presentation_of(study).drawn, *models.presentation_of(study).main)
        return next((usual for usual in drawn if usual in known), known[0])
    return choice_of("y", name, known)


def _axis_ends(study: Study, path: str) -> tuple[float, float] | None:
    axis = study.axis_of(path)
    if axis is None or not np.ptp(study.axes[axis].array) > 0.0:
        return None
    values = study.axes[axis].array
    return float(values.min()), float(values.max())


def _value(name: str, text: str | None, unit: str, usual: float | None) -> float:
    if text is None or not text.strip():
        if usual is None:
            raise parameter_error(
                name, "required", "is required, because the parameter is not on an axis of the study with a range",
                text, _value_in(unit),
            )  # fmt: skip
        return usual
    try:
        return typed_value(text, unit)
    except QuantityError as error:
        raise parameter_error(name, error.code, error.message, text, _value_in(unit)) from error


def _value_in(unit: str) -> Sentence:
    return Sentence("a value in {unit}", unit=Typed(unit))


def neighbours(study: Study, case: int, along: Along) -> NDArray[np.int64]:
    """The cases of a grid that differ from one only in the parameter of a branch, or in the direction of a sweep.

    None of other studies.
    """
    axis = study.axis_of(along.paths[0])
    if axis is None or study.combine != "grid":
        return np.empty(0, dtype=np.int64)
    values = study.axes[axis].array
    free = {axis: np.flatnonzero((values >= along.low) & (values <= along.high))}
    if study.sweep is not None and study.axes[-1].paths == (SWEEP,):
        free[len(study.axes) - 1] = np.arange(len(study.axes[-1]))
    places = [free.get(k, index) for k, index in enumerate(study.indices([case]))]
    return np.array(
        [study.case_number(list(map(int, chosen))) for chosen in itertools.product(*places)], dtype=np.int64
    )


BranchAnswer = CaseAnswer[tuple[Along, str], CaseBranch]


class BranchView(Strobed, CaseView[BranchQuestion, tuple[Along, str], CaseBranch]):
    """The periodic motions that the motion of a case becomes along a parameter."""

    about = BRANCH
    content = "The branch as JSON, its points as CSV, or a picture."
    shape = Branch

    def choose(self, study: Study, case: int, question: BranchQuestion) -> tuple[Along, str]:
        """The parameter with its range, and the result of a picture."""
        return along_of(study, case, question.along, question.low, question.high), result_of(study, question.y)

    def compute(self, study: Study, case: int, chosen: tuple[Along, str]) -> CaseBranch:
        """Follow the branch."""
        return run_branch(study, case, chosen[0])

    def json(self, answer: BranchAnswer) -> Branch:
        """The branch as JSON data."""
        made, (along, _result) = answer.result, answer.chosen
        return {
            "case": answer.case,
            "parameters": answer.parameters,
            "along": list(along.paths),
            "unit": unit_of(answer.study, along.paths[0]),
            "low": along.low,
            "high": along.high,
            "value": made.value,
            "order": made.order or None,
            "parameter": made.parameters.tolist(),
            "stable": made.stable.tolist(),
            "multiplier": made.multipliers.tolist(),
            "variables": {name: {"unit": unit} for name, unit in zip(made.names, made.units, strict=True)},
            "values": dict(zip(made.names, map(numbers, made.values.T), strict=True)),
            "specials": [
                {
                    "kind": special.kind,
                    "meaning": special.meaning,
                    "parameter": special.parameter,
                    "index": special.index,
                    "multipliers": [[value.real, value.imag] for value in special.multipliers],
                    "contacts": [filled(BranchContact, contact) for contact in special.contacts],
                }
                for special in made.specials
            ],
            "ends": list(made.ends) if made.order else [],
            "note": made.note or None,
        }

    def csv(self, answer: BranchAnswer) -> bytes:
        """The points: the parameter, whether the motion is stable, its multiplier, what is special, the results."""
        made = answer.result
        kinds = [""] * len(made.parameters)
        for special in made.specials:
            kinds[special.index] = special.kind
        stable = ["true" if stable else "false" for stable in made.stable.tolist()]
        header = [answer.chosen[0].paths[0], "stable", "multiplier", "special", *made.names]
        return table_csv(
            header, [made.parameters.tolist(), stable, made.multipliers.tolist(), kinds, *made.values.T.tolist()]
        )

    def rows(self, store: Store, study_id: str, study: Study, case: int, chosen: tuple[Along, str]) -> OwnCases:
        """The finished cases of the study that differ from this one in the parameter only."""
        along, result = chosen
        cases = neighbours(study, case, along)
        y = store.rows.for_cases(study_id, cases, [result]).values[result]
        x = study.columns(cases)[along.paths[0]] if cases.size else np.empty(0)
        kept = np.isfinite(y)
        return OwnCases(x[kept], y[kept], cases[kept])

    def figure(self, answer: BranchAnswer, columns: int = 2) -> Figure:
        """One result over the parameter, with the study's own cases beside it."""
        return branch_figure(answer.result, answer.study, *answer.chosen, answer.rows)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """The parameters, and the results of an orbit."""
        return {
            "along": along_offered(study, case),
            **ENDS_OFFERED,
            "y": Offered((result_of(study, None),), groups=named(branch_results(study))),
        }

    def shown(self, answer: BranchAnswer) -> Shown:
        """How far the branch goes, and what is special on it; or why there is none."""
        made = answer.result
        if made.note:
            return Shown((Phrase("This case has no branch: {why}", why=made.note),))
        ends = {"first": Phrase(made.ends[0]), "last": Phrase(made.ends[1])}
        sentence = plural(
            "{count} orbit of order {order}; from {first} to {last}",
            "{count} orbits of order {order}; from {first} to {last}",
            len(made.parameters), order=made.order, **ends,
        )  # fmt: skip
        unit = unit_of(answer.study, answer.chosen[0].paths[0])
        return Shown((sentence, *(special_text(special, unit) for special in made.specials)))

    def said(self, answer: BranchAnswer) -> Said:
        """How many orbits there are."""
        data = {"points": len(answer.result.parameters), "specials": len(answer.result.specials)}
        return Said(data, not answer.result.note)
