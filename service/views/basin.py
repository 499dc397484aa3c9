"""To which regime one case comes from each start of a grid of two initial values: JSON, CSV, and what is asked for."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Sentence, Typed
from sprag_study.service.answers.results import BasinData, RegimeRow
from sprag_study.service.exports import table_csv
from sprag_study.service.faults import FaultError, parameter_error
from sprag_study.service.figures.basin import basin_figure
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.reader import Phrase, term
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.reading.units import QuantityError, typed_value
from sprag_study.service.reading.wording import percent
from sprag_study.service.results.selection import ends_of_range
from sprag_study.service.results.start_states import refuse_impossible
from sprag_study.service.views.branch import named
from sprag_study.service.views.case_questions import BASIN, BasinQuestion
from sprag_study.service.views.case_view import CaseAnswer, CaseView
from sprag_study.service.views.portrait import require_settled
from sprag_study.service.views.setting import Offered
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.worker import models
from sprag_study.worker.models import Basin
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.starts import STARTS, has_starts

if TYPE_CHECKING:
    from sprag_study.service.figures.figure import Figure
    from sprag_study.worker.models import Parameter
    from sprag_study.worker.study import Study

#: Initial values that a basin can be drawn over.
INITIAL: Final = ("initial_angle", "initial_speed", "initial_windup")
#: For "x" and "y" the first and the last value as text, None where they are those of the starts.
Ends = dict[str, tuple[str | None, str | None]]
#: Columns of the table of the regimes.
_COLUMNS: Final = (
    Column(Phrase("No.")), Column(Phrase("Regime")), Column(Phrase("Order")), Column(Phrase("Share of the starts")),
    Column("shaft.speed.mean", "rad/s"),
)  # fmt: skip
#: What is reported of each regime besides its number.
_SPEED: Final = "shaft.speed.mean"
_SHOWN: Final = ("regime", "regime.order", "regime.share", _SPEED)


@dataclass(frozen=True, slots=True)
class BasinQuery:
    """Two initial values, and the values (SI) of each."""

    paths: tuple[str, str]
    x: tuple[float, float]
    y: tuple[float, float]
    points: int

    def axes(self) -> tuple[np.ndarray, np.ndarray]:
        """The values of both: equally spaced, the ends among them."""
        return np.linspace(*self.x, self.points), np.linspace(*self.y, self.points)


def initial_values(study: Study) -> dict[str, Parameter]:
    """The initial values of a study's machine by path."""
    catalogue = {entry.path: entry for entry in models.parameter_catalogue(study.model)}
    found: dict[str, Parameter] = {}
    for path in study.base:
        plain = ".".join("N" if part.isdigit() else part for part in path.split("."))
        if plain.rpartition(".")[2] in INITIAL and plain in catalogue:
            found[path] = catalogue[plain]
    return found


def _ranges(study: Study) -> dict[str, list[float]]:
    """Those of the study's starts, by path."""
    return study.run[STARTS]["ranges"] if has_starts(study.run) else {}


def usual_ends(study: Study) -> dict[str, tuple[str, str]]:
    """The ends of the ranges of the study's starts with their units, by path."""
    ranges = _ranges(study)
    known = initial_values(study)
    return {
        path: (quantity_text(low, known[path].unit), quantity_text(high, known[path].unit))
        for path, (low, high) in ranges.items()
        if path in known
    }


def has_basin(study: Study) -> bool:
    """Whether cases settle, and have initial values."""
    return models.is_settled(study.run) and bool(initial_values(study))


def basin_paths(study: Study, x: str | None, y: str | None) -> tuple[str, str]:
    """The two initial values, by default the first ones of the study's starts; FaultError about a parameter."""
    if not has_basin(study):
        raise FaultError("not-found", "Only cases that run until their motion is settled have basins.")
    known = initial_values(study)
    ranges = _ranges(study)
    usual = [path for path in (*ranges, *known) if path in known]
    paths: list[str] = []
    for name, given in (("x", x), ("y", y)):
        path = given or next(path for path in usual if path not in paths and path != (y if name == "x" else x))
        if path not in known:
            raise parameter_error(name, "unknown-name", "is not an initial value", path, ", ".join(known))
        if path in paths:
            raise parameter_error(name, "repeated", "is the other initial value too", path, "two different ones")
        paths.append(path)
    return paths[0], paths[1]


def basin_query(study: Study, case: int, x: str | None, y: str | None, ends: Ends, points: int) -> BasinQuery:
    """What is asked for of a case; FaultError about a parameter.

    Initial values from which no motion begins in this case are refused.
    """
    paths = basin_paths(study, x, y)
    known = initial_values(study)
    ranges = _ranges(study)
    both = [_ends(name, known[path], ranges.get(path), ends[name]) for name, path in zip("xy", paths, strict=True)]
    corners = [dict(zip(paths, corner, strict=True)) for corner in itertools.product(*both)]
    refuse_impossible({paths[0]: "x", paths[1]: "y"}, case_machine(study, case), corners)
    return BasinQuery(paths, both[0], both[1], points)


def _ends(
    name: str, entry: Parameter, drawn: list[float] | None, given: tuple[str | None, str | None]
) -> tuple[float, float]:
    values: list[float] = []
    ends = ends_of_range((f"{name}_from", f"{name}_to"), *given, entry.unit)
    for place, text in zip(("from", "to"), ends, strict=True):
        if text is None:
            if drawn is None:
                allowed = Sentence(
                    "a quantity in {unit}: the study has no starts with a range of it", unit=Typed(entry.unit)
                )
                raise parameter_error(f"{name}_{place}", "required", "is required", None, allowed)
            values.append(drawn[len(values)])
            continue
        try:
            value = typed_value(text, entry.unit)
        except QuantityError as error:
            raise parameter_error(f"{name}_{place}", error.code, error.message, text, range_sentence(entry)) from error
        if not entry.accepts(value):
            raise parameter_error(f"{name}_{place}", "out-of-range", "is out of range", text, range_sentence(entry))
        values.append(value)
    if not values[0] < values[1]:
        raise parameter_error(f"{name}_to", "invalid-range", "is not above the first value", given[1], "above it")
    return values[0], values[1]


def basin_json(study: Study, query: BasinQuery, made: Basin) -> BasinData:
    """A basin as JSON data."""
    infos = models.results_by_name(study)
    regimes: list[RegimeRow] = []
    for number, row in enumerate(made.values.tolist()):
        results: dict[str, Any] = {}
        for name in _SHOWN:
            value = row[made.names.index(name)]
            results[name] = infos[name].cell(value) if name in infos else value
        regimes.append({"number": number, "flags": [], "results": results})
    return {
        "x": query.paths[0],
        "y": query.paths[1],
        "x_values": made.x.tolist(),
        "y_values": made.y.tolist(),
        "numbers": made.members.tolist(),
        "regimes": regimes,
    }


BasinAnswer = CaseAnswer[BasinQuery, Basin]


class BasinView(CaseView[BasinQuestion, BasinQuery, Basin]):
    """To which regime a case comes from each start of a grid of two initial values."""

    about = BASIN
    content = "The grid as JSON or CSV, or a picture."
    shape = BasinData
    lacks = N_("has no motion that settles")

    def choose(self, study: Study, case: int, question: BasinQuestion) -> BasinQuery:
        """The grid of initial values."""
        require_settled(study, case)
        ends = {"x": (question.x_from, question.x_to), "y": (question.y_from, question.y_to)}
        return basin_query(study, case, question.x, question.y, ends, question.points)

    def compute(self, study: Study, case: int, chosen: BasinQuery) -> Basin:
        """Run the case from every start."""
        return models.run_basin(study, case, chosen.paths, *chosen.axes())

    def json(self, answer: BasinAnswer) -> BasinData:
        """The grid as JSON data."""
        return basin_json(answer.study, answer.chosen, answer.result)

    def csv(self, answer: BasinAnswer) -> bytes:
        """A row for each start: both initial values, the number of the regime, and its mean speed."""
        across, along = np.meshgrid(answer.result.x, answer.result.y)
        members, speeds = answer.result.members.reshape(-1), answer.result.values[:, answer.result.names.index(_SPEED)]
        columns: list[list[Any]] = [
            across.reshape(-1).tolist(),
            along.reshape(-1).tolist(),
            members.tolist(),
            [float(speeds[member]) if member >= 0 else None for member in members],
        ]
        return table_csv([*answer.chosen.paths, "regime.number", _SPEED], columns)

    def figure(self, answer: BasinAnswer, columns: int = 2) -> Figure:
        """Points in the plane of both initial values, a colour for each regime."""
        known, (x, y) = initial_values(answer.study), answer.chosen.paths
        return basin_figure(answer.result, (x, y), (known[x].unit, known[y].unit))

    def has(self, study: Study) -> bool:
        """Whether cases settle, and have initial values."""
        return has_basin(study)

    def offered(self, study: Study, case: int) -> dict[str, Offered]:
        """The initial values; ranges as in the study's starts, otherwise none."""
        known, ends = initial_values(study), usual_ends(study)
        x, y = basin_paths(study, None, None)
        found = {"x": Offered((x,), groups=named(known)), "y": Offered((y,), groups=named(known))}
        for name, path in (("x", x), ("y", y)):
            hints = ends.get(path, (known[path].unit, known[path].unit))
            found |= {f"{name}_{end}": Offered(hint=hint) for end, hint in zip(("from", "to"), hints, strict=True)}
        return found

    def shown(self, answer: BasinAnswer) -> Shown:
        """The regimes to which the starts come."""
        rows = [
            [
                row["number"],
                term(str(own["regime"])),
                own["regime.order"],
                percent(float(own["regime.share"] or 0.0)),
                own[_SPEED],
            ]
            for row in basin_json(answer.study, answer.chosen, answer.result)["regimes"]
            for own in (row["results"],)
        ]
        return Shown(tables=(ShownTable(_("Regimes"), _COLUMNS, rows),))
