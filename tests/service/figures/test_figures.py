"""What figures of curves and motions are about."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service import languages
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.figures.motion import motion_figure, phase_figure
from sprag_study.service.figures.portrait import portrait_figure
from sprag_study.service.figures.svg import svg
from sprag_study.service.http.web.comparison.answer import without_empty
from sprag_study.service.reading.reader import shown as shown_text
from sprag_study.service.results.curve_cases import draw, select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.worker import models
from tests.service.figures.seen import seen

if TYPE_CHECKING:
    from numpy.typing import NDArray

SPEED, TORQUE = "shaft.speed.mean", "torque.mean"


def fetch(cases: NDArray[np.int64], names: Any) -> CaseColumns:
    return CaseColumns(cases, ["ok"] * cases.size, {name: cases.astype(float) for name in names})


def test_a_failed_case_has_no_place_in_a_figure(spec: dict[str, Any]) -> None:
    """Its row may have results, such as energies of an unstable motion: they are no values of the machine."""
    spec["axes"] = [{"path": "shaft.load", "values": [0, 0.1, 1]}]
    study = parse_spec(spec).study

    def failed(cases: NDArray[np.int64], names: Any) -> CaseColumns:
        known = fetch(cases, names)
        return CaseColumns(known.cases, ["ok", "unstable_motion", "ok"], known.values)

    chosen = select(study, CurveQuery("shaft.load", (SPEED,)))
    (panel,) = curves_figure([("", draw(chosen, failed))]).panels
    assert np.array_equal(panel.lines[0].y, [0.0, np.nan, 2.0], equal_nan=True)


def test_a_motion_is_drawn_over_its_states_and_as_a_portrait() -> None:
    times, angle = np.array([0.0, 0.1, 0.2]), "pendulums.0.angle"
    names = (angle, "pendulums.0.speed", "shaft.speed", "pendulums.0.torque", "power.input", "power.useful",
             "power.loss", "power.clutch")  # fmt: skip
    units = ("rad", "rad/s", "rad/s", "N*m", "W", "W", "W", "W")
    values = np.arange(24.0).reshape(3, 8)
    made = models.Trajectory(times, names, units, values, {"shaft": ("held", "held", "rotating")}, "ok")
    shown = models.model_of("vibration-drive").presentation
    described = motion_figure(made, shown)
    assert described.spans == {"Shaft": (("held", 0.0, 0.2), ("rotating", 0.2, 0.2))}
    page = seen(svg(described))
    assert page.has("States: held rotating", "Shaft")
    assert len(page.panels) == len(described.panels)
    (orbit,) = phase_figure(made, shown).panels[0].lines
    with languages.language("uk"):
        portrait = portrait_figure(models.Portrait("", 1, made, made, 1, "ok"), shown)
        assert {shown_text(line.name) for line in portrait.panels[0].lines} >= {"Маятник 1"}
        assert {shown_text(line.name) for line in portrait.panels[1].lines} >= {"Вал"}
    assert (orbit.x.tolist(), orbit.y.tolist(), orbit.colour) == ([0.0, 8.0, 16.0], [1.0, 9.0, 17.0], PALETTE[0])


def test_a_comparison_has_no_empty_chart() -> None:
    x = np.array([0.0, 1.0])
    full, empty = (Panel(Quantity(name, "1"), (Line("", x, values, PALETTE[0]),))
                   for name, values in (("full", x), ("empty", np.full(2, np.nan))))  # fmt: skip
    assert without_empty(Figure(Quantity("x", "1"), (empty, full))).panels == (full,)
    assert without_empty(Figure(Quantity("x", "1"), (empty,))).panels == (empty,)
