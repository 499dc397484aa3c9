"""Pictures and pages draw the same description: the same points, colours and marks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from sprag.service import languages
from sprag.service.figures.curves import curves_figure
from sprag.service.figures.figure import PALETTE
from sprag.service.figures.motion import motion_figure, phase_figure
from sprag.service.figures.pictures.curves import paint_figure, painting
from sprag.service.figures.portrait import portrait_figure
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.reading.reader import shown as shown_text
from sprag.service.results.curve_cases import draw, select
from sprag.service.results.curves import CurveQuery
from sprag.service.spec.document import parse_spec
from sprag.service.storage.studies.records import CaseColumns
from sprag.worker import models

if TYPE_CHECKING:
    from numpy.typing import NDArray

SPEED, TORQUE = "shaft.speed.mean", "torque.mean"


def fetch(cases: NDArray[np.int64], names: Any) -> CaseColumns:
    return CaseColumns(cases, ["ok"] * cases.size, {name: cases.astype(float) for name in names})


def test_both_painters_draw_the_described_lines(spec: dict[str, Any]) -> None:
    spec["axes"] = [{"path": "excitation.frequency", "values": [20, 25]}, {"path": "shaft.load", "values": [0, 0.1, 1]}]
    study = parse_spec(spec).study
    query = CurveQuery("shaft.load", (SPEED, TORQUE), ("excitation.frequency",))
    described = curves_figure([("", draw(select(study, models.study_results(study), query), fetch))])
    page, picture = plotly_figure(described), Figure()
    with painting():
        paint_figure(picture, described, "")
    drawn = [line for axes in picture.axes for line in axes.lines]
    assert [trace["x"] for trace in page["data"]] == [list(line.get_xdata()) for line in drawn]
    assert [trace["y"] for trace in page["data"]] == [list(line.get_ydata()) for line in drawn]
    assert [trace["line"]["color"] for trace in page["data"]] == [to_hex(str(line.get_color())) for line in drawn]
    assert [trace["name"] for trace in page["data"]] == [str(line.get_label()) for line in drawn]


def test_a_failed_case_has_no_place_in_a_figure(spec: dict[str, Any]) -> None:
    """Its row may have results, such as energies of an unstable motion: they are no values of the machine."""
    spec["axes"] = [{"path": "shaft.load", "values": [0, 0.1, 1]}]
    study = parse_spec(spec).study

    def failed(cases: NDArray[np.int64], names: Any) -> CaseColumns:
        known = fetch(cases, names)
        return CaseColumns(known.cases, ["ok", "unstable_motion", "ok"], known.values)

    chosen = select(study, models.study_results(study), CurveQuery("shaft.load", (SPEED,)))
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
    page = plotly_figure(described)
    assert page["zoom"] is True
    assert [trace["name"] for trace in page["data"] if trace["type"] == "bar"] == ["held", "rotating"]
    assert {trace["xaxis"] for trace in page["data"] if trace["type"] == "scatter"} == {"x"}
    (orbit,) = phase_figure(made, shown).panels[0].lines
    with languages.language("uk"):
        portrait = portrait_figure(models.Portrait("", 1, made, made, 1, "ok"), shown)
        assert {shown_text(line.name) for line in portrait.panels[0].lines} >= {"Маятник 0"}
        assert {shown_text(line.name) for line in portrait.panels[1].lines} >= {"Вал"}
    assert (orbit.x.tolist(), orbit.y.tolist(), orbit.colour) == ([0.0, 8.0, 16.0], [1.0, 9.0, 17.0], PALETTE[0])
