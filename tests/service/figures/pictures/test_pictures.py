"""What pictures of curves and maps show: names, values and units of everything, and nothing that was not computed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from sprag.service.figures.curves import curves_figure
from sprag.service.figures.figure import Quantity
from sprag.service.figures.pictures import curves as pictures
from sprag.service.figures.pictures import maps
from sprag.service.figures.read import read_map
from sprag.service.reading.reader import Reading
from sprag.service.results.curve_cases import draw, draw_map, select
from sprag.service.results.curves import CurveQuery
from sprag.service.spec.document import parse_spec
from sprag.service.storage.studies.records import CaseColumns
from sprag.worker import models

if TYPE_CHECKING:
    from matplotlib.backend_bases import RendererBase
    from numpy.typing import NDArray

TIED = ["excitation.amplitude_x", "excitation.amplitude_y"]
SPEED = "shaft.speed.mean"


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are drawn."""
    drawn: list[Figure] = []

    def render(paint: Callable[[Figure], None], picture: str, size: tuple[float, float]) -> bytes:
        drawn.append(Figure(figsize=size, layout="constrained"))
        paint(drawn[-1])
        drawn[-1].draw_without_rendering()
        return b""

    for module in (pictures, maps):
        monkeypatch.setattr(module, "render", render)
    return drawn


def fetch(cases: NDArray[np.int64], names: Any) -> CaseColumns:
    """The number of the case as every result."""
    return CaseColumns(cases, ["ok"] * cases.size, {name: cases.astype(float) for name in names})


def curves(spec: dict[str, Any], *y: str, by: tuple[str, ...] = (), at: tuple[tuple[str, str], ...] = ()) -> None:
    study = parse_spec(spec).study
    query = CurveQuery("shaft.load", y or (SPEED,), by, at)
    pictures.draw_curves(
        draw(select(study, models.study_results(study), query), fetch), "A study", "svg", Reading(study.model)
    )


def grid(spec: dict[str, Any], frequencies: int) -> dict[str, Any]:
    return {
        **spec,
        "axes": [
            {"path": "excitation.frequency", "linspace": [20, 35, frequencies]},
            {"path": TIED, "values": ["1 mm", "2 mm"]},
            {"path": "shaft.load", "values": [0, 0.1, 1.6]},
        ],
    }


def test_values_that_are_held_stand_above_the_picture(spec: dict[str, Any], figures: list[Figure]) -> None:
    curves(grid(spec, 16), at=(("excitation.amplitude_y", "2 mm"), ("excitation.frequency", "1500 rpm")))
    assert figures[0].get_suptitle().splitlines() == [
        "A study",
        "Vertical amplitude = horizontal amplitude = 0.002 m; Excitation frequency = 25 Hz",
    ]


def test_long_titles_are_broken_between_values(spec: dict[str, Any], figures: list[Figure]) -> None:
    paths = ["pendulums.0.mass", "pendulums.0.inertia", "pendulums.0.spring_rate", "pendulums.0.damping"]
    spec["axes"] = [{"path": "shaft.load", "values": [0, 1]}, *({"path": path, "values": [1, 2]} for path in paths)]
    curves(spec, at=tuple((path, "1") for path in paths))
    first, *lines = figures[0].get_suptitle().splitlines()
    assert first == "A study"
    assert lines == [
        "Mass, pendulum 0 = 1 kg; Inertia, pendulum 0 = 1 kg·m²; Spring rate, pendulum 0 = 1 N/m;",
        "Damping, pendulum 0 = 1 N·m·s/rad; Excitation frequency = 25 Hz; Horizontal amplitude = 0.002 m;",
        "Vertical amplitude = 0.002 m",
    ]


def test_few_curves_have_a_legend_with_units(spec: dict[str, Any], figures: list[Figure]) -> None:
    curves(grid(spec, 2), by=("excitation.amplitude_x",), at=(("excitation.frequency", "20 Hz"),))
    (legend,) = figures[0].legends
    # It has the title of the picture, which stands above it.
    assert legend.get_title().get_text().splitlines() == [
        "A study", "Excitation frequency = 20 Hz", "Horizontal amplitude = vertical amplitude (m)",
    ]  # fmt: skip
    assert figures[0].get_suptitle() == ""
    assert [text.get_text() for text in legend.get_texts()] == ["0.001", "0.002"]


def test_a_picture_is_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Line2D] = []
    draw_line = Line2D.draw

    def counted(line: Line2D, renderer: RendererBase) -> None:
        drawn.append(line)
        draw_line(line, renderer)

    monkeypatch.setattr(Line2D, "draw", counted)
    for picture in pictures.PICTURES:
        assert pictures.render(lambda figure: figure.subplots().plot([1.0, 2.0], [0.0, 1.0]), picture, (3.0, 2.0))
        assert len(set(drawn)) == len(drawn)


def test_long_names_of_axes_have_several_lines(spec: dict[str, Any], figures: list[Figure]) -> None:
    study = parse_spec({**spec, "axes": [{"path": "shaft.load", "values": [0, 1]}]}).study
    query = CurveQuery("shaft.load", (SPEED,))
    figure = curves_figure([("", draw(select(study, models.study_results(study), query), fetch))])
    long = replace(figure, panels=(replace(figure.panels[0], y=Quantity("word " * 20, "m")),) * 12)
    pictures.draw_figure(long, "", "svg", paper=True)
    height = figures[0].get_figheight() * 72.0 / 12
    for axes in figures[0].axes[:12]:
        lines = axes.get_ylabel().splitlines()
        assert len(lines) > 2
        assert max(map(len, lines)) * 0.5 * axes.yaxis.label.get_fontsize() < height


def test_each_of_many_curves_is_named(spec: dict[str, Any], figures: list[Figure]) -> None:
    curves(grid(spec, 16), by=("excitation.frequency",), at=(("excitation.amplitude_x", "1 mm"),))
    curves(grid(spec, 16), SPEED, "efficiency", by=("excitation.frequency", "excitation.amplitude_x"))
    one, two = (figure.axes[-1] for figure in figures)
    assert one.get_ylabel() == "Excitation frequency (Hz)"
    assert [text.get_text() for text in one.get_yticklabels()] == [str(frequency) for frequency in range(20, 36)]
    assert "Horizontal amplitude = vertical amplitude (m)" in two.get_ylabel()
    assert [text.get_text() for text in two.get_yticklabels()][:2] == ["20, 0.001", "21, 0.001"]


def test_listed_points_of_one_machine_are_joined_in_order(spec: dict[str, Any], figures: list[Figure]) -> None:
    loads = {"path": "shaft.load", "values": [0.3, 0.1, 0.1, 0.2, 0.1]}
    zipped = {"combine": "zip", "axes": [loads, {"path": "excitation.frequency", "values": [25, 16, 25, 16, 20]}]}
    curves({**spec, **zipped})
    drawn = [np.asarray(line.get_xdata()).tolist() for line in figures[0].axes[0].lines]
    assert [x for x in drawn if len(x) > 1] == [[0.1, 0.2], [0.1, 0.3]]


def test_the_outer_cells_of_a_map_are_whole(spec: dict[str, Any], figures: list[Figure]) -> None:
    study = parse_spec(grid(spec, 4)).study
    at = (("excitation.amplitude_x", "2 mm"),)
    infos = models.study_results(study)
    for y in ("excitation.frequency", "excitation.amplitude_x"):
        held = at if y == "excitation.frequency" else (("excitation.frequency", "20 Hz"),)
        made = draw_map(study, infos, "shaft.load", y, SPEED, held, fetch)
        maps.draw_map(read_map(made, Reading(study.model)), "A study", "png")
    axes, bar = figures[0].axes
    assert axes.collections[0].get_datalim(axes.transData).extents.tolist() == [-0.05, 17.5, 2.35, 37.5]
    assert figures[0].get_suptitle() == "A study\nHorizontal amplitude = vertical amplitude = 0.002 m"
    assert bar.get_ylabel() == "Mean shaft speed (rad/s)"
    assert figures[1].axes[0].get_ylabel() == "Horizontal amplitude = vertical amplitude (m)"


def test_cases_without_a_result_are_grey(spec: dict[str, Any], figures: list[Figure]) -> None:
    def nothing(cases: NDArray[np.int64], names: Any) -> CaseColumns:
        return CaseColumns(cases, [None] * cases.size, {name: np.full(cases.size, np.nan) for name in names})

    spec["axes"] = [{"path": "shaft.load", "values": [0, 1]}, {"path": "excitation.frequency", "values": [25]}]
    study = parse_spec(spec).study
    made = draw_map(study, models.study_results(study), "shaft.load", "excitation.frequency", SPEED, (), nothing)
    maps.draw_map(made, "", "png")
    assert figures[0].get_suptitle().endswith(" = 0.002 m; grey: 2 cases without a result")
    assert figures[0].axes[0].get_yticks().tolist() == [25.0]
