"""A figure to download has the colours, words and order of the screen."""

from __future__ import annotations

import re
from html import unescape
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from sprag.service.figures.pictures import curves as pictures
from sprag.service.figures.pictures.legends import MARKERS
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.reading.reader import Choice
from sprag.service.results.curves import CurveQuery
from sprag.service.views.answers import AnswersChoice, AnswersView
from sprag.service.views.curves import CurvesView
from sprag.service.views.library import Library
from sprag.service.views.study_view import study_file
from sprag.worker import models
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from sprag.service.figures.figure import Figure as Described
    from tests.service.conftest import Service

Y = ("torque.mean", "shaft.speed.mean", "efficiency")
CHOICE = Choice("speed=rpm,torque=N*mm,frequency=rpm")


def painted(monkeypatch: pytest.MonkeyPatch, draw: Any, *args: Any) -> tuple[Figure, Described]:
    """What matplotlib paints for a file, and what it was told to paint."""
    found: list[tuple[Figure, Described]] = []
    paint = pictures.paint_figure

    def kept(figure: Figure, drawn: Described, title: str) -> None:
        paint(figure, drawn, title)
        found.append((figure, drawn))

    monkeypatch.setattr(pictures, "paint_figure", kept)
    draw(*args)
    (only,) = found
    return only


def test_a_picture_is_the_figure_of_the_page(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = service.submit(changed({"/axes/0/linspace/2": 4}))
    service.fill(study_id)
    library: Library = service.app.state.context.library
    at = (("excitation.amplitude_x", "1 mm"),)
    query = CurveQuery("shaft.load", Y, ("excitation.frequency",), at)
    page = service.http.get(
        f"/studies/{study_id}/figures/curves",
        params={"x": query.x, "y": Y, "by": query.by, "at": "excitation.amplitude_x=1 mm", "columns": 2,
                "units": CHOICE.units},
    ).json()  # fmt: skip
    picture, described = painted(monkeypatch, study_file, library, study_id, CurvesView(), query, CHOICE, "", "svg")
    assert plotly_figure(described)["layout"]["height"] == page["layout"]["height"]
    assert len(page["data"]) == len(plotly_figure(described)["data"]) == 3 * 4
    titles = [page["layout"][f"yaxis{number or ''}"]["title"]["text"] for number in ("", 2, 3)]
    assert [axes.get_ylabel() for axes in picture.axes[:3]] == titles
    assert titles == ["Mean clutch torque (N·mm)", "Mean shaft speed (rpm)", "Efficiency"]
    for place, axes in enumerate(picture.axes[:3]):
        own = [trace for trace in page["data"] if trace["yaxis"] == f"y{place + 1 if place else ''}"]
        assert [to_hex(line.get_color()) for line in axes.lines] == [trace["line"]["color"] for trace in own]
        assert [str(line.get_label()) for line in axes.lines] == [trace["name"] for trace in own]
        assert [line.get_marker() for line in axes.lines] == [MARKERS[trace["marker"]["symbol"]] for trace in own]
        assert len({line.get_marker() for line in axes.lines}) == 4
        assert page["layout"][trace_axis(own[0])]["rangemode"] == "tozero"
        assert axes.get_ylim()[0] <= 0.0 <= axes.get_ylim()[1]
        for line, trace in zip(axes.lines, own, strict=True):
            known = [float(value) for value in np.asarray(line.get_ydata(), dtype=float) if np.isfinite(value)]
            assert known == [value for value in trace["y"] if value is not None]


def trace_axis(trace: dict[str, Any]) -> str:
    """The key of the y axis of a trace in the layout."""
    return f"yaxis{trace['yaxis'][1:]}"


def test_the_answers_of_a_picture_are_those_of_the_page(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = service.submit()
    service.fill(study_id)
    library: Library = service.app.state.context.library
    page = service.http.get(f"/studies/{study_id}/figures/answers?columns=2&units={CHOICE.units}").json()
    _, described = painted(
        monkeypatch, study_file, library, study_id, AnswersView(), AnswersChoice(None, None), CHOICE, "", "svg"
    )
    assert models.presentation_of(service.store.studies.study(study_id)).main
    drawn = plotly_figure(described)
    assert [trace["name"] for trace in drawn["data"]] == [trace["name"] for trace in page["data"]]
    assert [trace["y"] for trace in drawn["data"]] == [trace["y"] for trace in page["data"]]


def svg_of(service: Service, address: str) -> tuple[list[str], list[str]]:
    """Texts of a downloaded SVG, which matplotlib keeps in comments, and the colours of its lines, both in order."""
    answer = service.http.get(address)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "image/svg+xml"
    texts = [unescape(text.strip()) for text in re.findall(r"<!-- (.*?) -->", answer.text, re.DOTALL)]
    return texts, list(dict.fromkeys(re.findall(r"stroke: (#[0-9a-f]{6})", answer.text)))


def downloaded(service: Service, page: str, figure: str, svg: str) -> tuple[dict[str, Any], list[str], list[str]]:
    """The figure that a page draws, and texts and colours of the SVG that it offers for download."""
    text = unescape(service.http.get(page).text)
    (drawn,) = re.findall(rf'data-figure="([^"]*{figure}\?[^"]*)"', text)
    (file,) = dict.fromkeys(re.findall(rf'href="([^"]*{svg}[^"]*format=svg)"', text))
    shown: dict[str, Any] = service.http.get(drawn).json()
    return shown, *svg_of(service, file)


def in_order(wanted: list[str], found: list[str]) -> bool:
    """Whether ``wanted`` occur among ``found`` in their order."""
    rest = iter(found)
    return all(text in rest for text in wanted)


def titles(figure: dict[str, Any], axis: str) -> list[str]:
    """The titles of the axes of a plotly figure, in order, without empty ones."""
    layout = figure["layout"]
    names = sorted((name for name in layout if name.startswith(f"{axis}axis")), key=lambda name: int(name[5:] or 1))
    return [title for name in names if (title := layout[name].get("title", {}).get("text", ""))]


def listed(figure: dict[str, Any]) -> list[dict[str, Any]]:
    """The traces in the legend, in order."""
    return [trace for trace in figure["data"] if trace.get("showlegend", True) and trace.get("name")]


@pytest.mark.parametrize("kind", ["heatmap", "contour"])
def test_a_downloaded_map_is_that_of_the_page(service: Service, kind: str) -> None:
    study_id = service.submit()
    service.fill(study_id)
    chosen = f"x=shaft.load&y=excitation.frequency&z=torque.mean&kind={kind}&units={CHOICE.units}"
    page, texts, strokes = downloaded(service, f"/studies/{study_id}/map?{chosen}", "figures/map", "map?")
    (trace, *_) = page["data"]
    assert trace["type"] == kind
    assert trace["colorscale"] == "Viridis"
    assert trace["colorbar"]["title"]["text"] == "Mean clutch torque (N·mm)"
    assert {*titles(page, "x"), *titles(page, "y"), "Mean clutch torque (N·mm)"} <= set(texts)
    assert ("#404040" in strokes) == (kind == "contour")  # the lines of equal value


def test_a_downloaded_family_is_that_of_the_page(service: Service) -> None:
    study_id = service.submit(changed({"/axes/0/linspace/2": 4}))
    service.fill(study_id)
    query = "&".join(f"y={name}" for name in Y)
    chosen = f"x=shaft.load&by=excitation.frequency&{query}&units={CHOICE.units}"
    page, texts, strokes = downloaded(service, f"/studies/{study_id}/curves?{chosen}", "figures/curves", "curves?")
    names = [trace["name"] for trace in listed(page)]
    assert len(names) == 4
    assert in_order(names, texts)
    assert in_order([trace["line"]["color"] for trace in listed(page)], strokes)
    assert in_order(titles(page, "y"), texts)
    assert set(titles(page, "x")) <= set(texts)
