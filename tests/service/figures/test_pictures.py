"""What pictures of curves and maps show: names, values and units of everything, and nothing that was not computed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.figure import Quantity
from sprag_study.service.figures.pictures import draw_curves, draw_figure
from sprag_study.service.figures.pictures import draw_map as paint_map
from sprag_study.service.figures.read import read_map
from sprag_study.service.reading.reader import Reading
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns
from tests.service.figures.seen import Seen, seen

if TYPE_CHECKING:
    from numpy.typing import NDArray

TIED = ["excitation.amplitude_x", "excitation.amplitude_y"]
SPEED = "shaft.speed.mean"


def fetch(cases: NDArray[np.int64], names: Any) -> CaseColumns:
    """The number of the case as every result."""
    return CaseColumns(cases, ["ok"] * cases.size, {name: cases.astype(float) for name in names})


def curves(spec: dict[str, Any], *y: str, by: tuple[str, ...] = (), at: tuple[tuple[str, str], ...] = ()) -> Seen:
    study = parse_spec(spec).study
    query = CurveQuery("shaft.load", y or (SPEED,), by, at)
    drawn = draw(select(study, query), fetch)
    return seen(draw_curves(drawn, "A study", "svg", Reading(study.model)))


def grid(spec: dict[str, Any], frequencies: int) -> dict[str, Any]:
    return {
        **spec,
        "axes": [
            {"path": "excitation.frequency", "linspace": [20, 35, frequencies]},
            {"path": TIED, "values": ["1 mm", "2 mm"]},
            {"path": "shaft.load", "values": [0, 0.1, 1.6]},
        ],
    }


def test_values_that_are_held_stand_above_the_picture(spec: dict[str, Any]) -> None:
    found = curves(grid(spec, 16), at=(("excitation.amplitude_y", "2 mm"), ("excitation.frequency", "1500 rpm")))
    assert found.texts[0] == "A study"
    assert found.has("A study Vertical amplitude = horizontal amplitude = 0.002 m; Excitation frequency = 25 Hz")


def test_few_curves_are_named_with_their_unit(spec: dict[str, Any]) -> None:
    found = curves(grid(spec, 2), by=("excitation.amplitude_x",), at=(("excitation.frequency", "20 Hz"),))
    assert found.has("A study Excitation frequency = 20 Hz", "Horizontal amplitude = vertical amplitude (m)")
    assert [found.texts.count(name) for name in ("0.001", "0.002")] == [1, 1]


def test_each_of_many_curves_has_its_colour_in_a_scale(spec: dict[str, Any]) -> None:
    found = curves(grid(spec, 16), by=("excitation.frequency",), at=(("excitation.amplitude_x", "1 mm"),))
    assert found.has("Excitation frequency (Hz)", *(str(frequency) for frequency in range(20, 36)))
    assert len({curve.colour for curve in found.panels[0].curves}) == 16


def test_long_names_of_panels_have_several_lines(spec: dict[str, Any]) -> None:
    study = parse_spec({**spec, "axes": [{"path": "shaft.load", "values": [0, 1]}]}).study
    figure = curves_figure([("", draw(select(study, CurveQuery("shaft.load", (SPEED,))), fetch))])
    long = replace(figure, panels=(replace(figure.panels[0], y=Quantity("word " * 40, "m")),) * 12)
    found = seen(draw_figure(long, "", "svg", paper=True))
    lines = [text for text in found.texts if text.startswith("word")]
    assert len(lines) > 2 * 12


def test_listed_points_of_one_machine_are_joined_in_order(spec: dict[str, Any]) -> None:
    loads = {"path": "shaft.load", "values": [0.3, 0.1, 0.1, 0.2, 0.1]}
    zipped = {"combine": "zip", "axes": [loads, {"path": "excitation.frequency", "values": [25, 16, 25, 16, 20]}]}
    found = curves({**spec, **zipped})
    drawn = [part[:, 0].round(2).tolist() for curve in found.panels[0].curves for part in curve.stretches]
    assert [x for x in drawn if len(x) > 1] == [[0.1, 0.2], [0.1, 0.3]]


def test_the_outer_cells_of_a_map_are_whole(spec: dict[str, Any]) -> None:
    study = parse_spec(grid(spec, 4)).study
    at = (("excitation.amplitude_x", "2 mm"),)
    made = draw_map(study, "shaft.load", "excitation.frequency", SPEED, at, fetch)
    drawn = paint_map(read_map(made, Reading(study.model)), "A study", "svg").decode()
    assert 'data-x="-0.05 2.35 ' in drawn
    assert 'data-y="17.5 37.5 ' in drawn
    found = seen(drawn)
    assert found.has("A study Horizontal amplitude = vertical amplitude = 0.002 m", "Mean shaft speed (rad/s)")


def test_cases_without_a_result_are_grey(spec: dict[str, Any]) -> None:
    def nothing(cases: NDArray[np.int64], names: Any) -> CaseColumns:
        return CaseColumns(cases, [None] * cases.size, {name: np.full(cases.size, np.nan) for name in names})

    spec["axes"] = [{"path": "shaft.load", "values": [0, 1]}, {"path": "excitation.frequency", "values": [25]}]
    study = parse_spec(spec).study
    made = draw_map(study, "shaft.load", "excitation.frequency", SPEED, (), nothing)
    assert seen(paint_map(made, "", "svg")).has("2 cases without a result")
    assert paint_map(made, "", "png").startswith(b"\x89PNG")
