"""Figures as SVG: nothing overlaps, points lead to their cases, a file is the picture of the page."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import pytest

from sprag_study.service.figures.figure import PALETTE, Figure, Fill, Line, Note, Panel, Quantity, line_colours
from sprag_study.service.figures.painter.elements import SMALL, lines_of, text_width
from sprag_study.service.figures.painter.names import Box, dense, distances
from sprag_study.service.figures.painter.scales import Scale, rounded_scale, tick_text
from sprag_study.service.figures.svg import picture_svg, spark, svg
from sprag_study.service.reading.reader import Phrase

X = np.linspace(0.0, 1.6, 9)


def figure(*slopes: float, scatter: int = 0) -> Figure:
    """Straight curves, or so many points that nothing joins."""
    colours = line_colours(max(len(slopes), 1))
    lines = [
        Line(f"{slope} mm", X, 100.0 * slope * X, colours[place], key=str(place), cases=np.arange(9))
        for place, slope in enumerate(slopes)
    ]
    if scatter:
        at = np.random.default_rng(1).random((2, scatter))
        lines.append(Line("cases", at[0], at[1], PALETTE[0], key="0", cases=np.arange(scatter), joined=False))
    return Figure(Quantity("load", "N*m"), (Panel(Quantity("speed", "rpm"), tuple(lines)),), most=200_000)


def texts(drawn: str, kind: str) -> list[tuple[float, float, str]]:
    """Place and text of the numbers of a kind of axis."""
    (group,) = (part for part in ElementTree.fromstring(drawn).iter() if part.get("class") == kind)
    return [(float(part.get("x", 0)), float(part.get("y", 0)), part.text or "") for part in group]


@pytest.mark.parametrize("width", [240, 350, 720, 1100])
@pytest.mark.parametrize("ends", [(0.0, 1.6), (0.0, 123_456_789.0), (-3e-7, 4e-7), (99.9, 100.1), (5.0, 5.0)])
def test_numbers_of_axes_never_touch(width: int, ends: tuple[float, float]) -> None:
    x = np.linspace(*ends, 9)
    line = Line("one", x, x, PALETTE[0], key="0")
    drawn = svg(Figure(Quantity("load", "N*m"), (Panel(Quantity("speed", "rpm"), (line,)),)), width=width)
    across, up = texts(drawn, "x"), texts(drawn, "y")
    for (left, _, text), (right, _, other) in pairwise(across):
        assert right - left > (text_width(text, SMALL) + text_width(other, SMALL)) / 2.0
    assert all(abs(one[1] - other[1]) > SMALL for one, other in pairwise(up))
    assert len(across) == len({text for *_, text in across}) >= 1


def test_names_stand_at_curves_that_are_apart() -> None:
    apart = svg(figure(1.0, 2.0, 3.0))
    assert re.findall(r'class="name"[^>]*>([^<]*)<', apart) == ["1.0 mm", "2.0 mm", "3.0 mm"]
    assert len(re.findall("1.0 mm</text>", apart)) == 1


def test_a_legend_names_curves_that_lie_on_each_other() -> None:
    together = svg(figure(1.0, 1.001, 1.002))
    assert 'class="name"' not in together
    assert together.count("1.001 mm</text>") == 1


def test_a_legend_has_the_signs_of_its_panels() -> None:
    """Of the line that is meant the area is ink too, and a dashed line is dashed beside its marker."""
    fill = Fill("5 to 95 %", X, X, 2.0 * X, PALETTE[0], key="0")
    middle = Line("50 %", X, 1.5 * X, PALETTE[0], key="0")
    nominal = Line("nominal", X, 1.5 * X, PALETTE[0], 1, key="0", cases=np.arange(9))
    panel = Panel(Quantity("speed", "rpm"), (middle, nominal), fills=(fill,))
    drawn = svg(Figure(Quantity("load", "N*m"), (panel,)), chosen="0")
    assert re.findall(r'<rect[^>]* fill="([^"]*)" fill-opacity="[^"]*"', drawn) == ["var(--ink)"]
    assert re.findall(r'd="M2 0h18"[^>]*?(?: stroke-dasharray="([^"]*)")?/>', drawn) == ["", "3 3"]


def test_points_are_links_to_their_cases() -> None:
    drawn = svg(figure(1.0, 2.0), cases="/studies/st_1/cases/")
    assert 'href="/studies/st_1/cases/3" tabindex="-1" data-case="3"' in drawn
    assert "<title>0.2 N·m, 40 rpm, 2.0 mm, case 1</title>" in drawn
    assert 'role="group"' in drawn
    assert "<a " not in svg(figure(1.0, 2.0))


def test_many_points_are_drawn_once_for_each_pixel() -> None:
    drawn = svg(figure(scatter=100_000), cases="/studies/st_1/cases/")
    (found,) = re.findall(r'data-cases="([^"]*)"', drawn)
    assert 10_000 < len(found.split()) == drawn.count("h0") < 100_000
    assert "<a " not in drawn


def test_a_file_is_the_picture_of_the_page_in_colours_of_its_own() -> None:
    page, file = svg(figure(1.0, 2.0)), picture_svg(figure(1.0, 2.0), "")
    paths = re.compile(r' d="([^"]*)"')
    assert paths.findall(page) == paths.findall(file)
    assert "var(--" in page
    assert "var(--" not in file
    assert PALETTE[1] in file
    assert file == picture_svg(figure(1.0, 2.0), "")


def test_titles_are_text_never_markup() -> None:
    named = replace(
        figure(1.0), heading='a < b & "c"', panels=(Panel(Quantity("<b>", "1"), figure(1.0).panels[0].lines),)
    )
    assert ElementTree.fromstring(picture_svg(named, "<script>")).tag.endswith("svg")


def test_texts_stay_as_they_are_beside_patterns() -> None:
    strip = {"Drive ~5 mm": (("held", 0.0, 0.8), ("url(#~0)", 0.8, 1.6))}
    drawn = picture_svg(replace(figure(1.0), spans=strip), "Drive ~5 mm")
    (name,) = set(re.findall(r'<pattern id="(p[0-9a-f]+-)', drawn))
    assert f'fill="url(#{name}1)"' in drawn
    assert '"url(#~' not in drawn
    assert re.findall(r">([^<]*~[^<]*)<", drawn) == [
        "Drive ~5 mm", "Drive ~5 mm", "Drive ~5 mm: held", "Drive ~5 mm: url(#~0)", "url(#~0)",
    ]  # fmt: skip


def test_axes_can_be_logarithmic_and_run_backwards() -> None:
    drawn = svg(replace(figure(1.0, 10.0), log=("y",), flipped=("x",)))
    assert [text for *_, text in texts(drawn, "y")][::3] == ["10", "100", "1000", "10\u202f000"]
    numbers = texts(drawn, "x")
    assert [at for at, *_ in numbers] == sorted((at for at, *_ in numbers), reverse=True)


def test_a_thumbnail_has_no_numbers() -> None:
    small = spark(figure(1.0, 2.0))
    assert "<text" not in small
    assert small.count("<path") == 3


def test_degrees_are_parts_of_a_turn() -> None:
    assert Scale(0.0, 360.0, 0.0, 500.0, unit="°").ticks() == [0, 45, 90, 135, 180, 225, 270, 315, 360]
    assert rounded_scale((3.0, 97.0), 180.0, zero=True, log=False, unit="rpm").high == 100.0


def test_a_text_breaks_between_words() -> None:
    assert lines_of("one two three", text_width("one two ")) == ["one two", "three"]
    assert lines_of("", 10.0) == []


@pytest.mark.parametrize(("low", "high"), [(20.223, 34.995), (1.1, 1.9), (6.0, 19.0), (3.0, 3000.0)])
def test_a_logarithmic_axis_has_round_numbers_within_a_decade_too(low: float, high: float) -> None:
    scale = Scale(low, high, 0.0, 800.0, log=True)
    for ticks in (scale.ticks(), scale.rising()):
        assert len(ticks) > 2
        assert all(low <= one <= high and len(tick_text(one).replace("\u202f", "")) <= 4 for one in ticks)


def test_a_number_at_a_point_stands_where_no_curve_runs() -> None:
    x, y = np.array([0.0, 0.1, 0.2, 0.3, 0.4, 1.6]), np.array([0.0, 3.37, 4.57, 3.67, 0.9, 0.0])
    note = Note(0.1, 3.37, PALETTE[0], "point", Phrase("3.37 W"))
    panel = Panel(Quantity("power", "W"), (Line("", x, y, PALETTE[0]),), notes=(note,))
    drawn = svg(Figure(Quantity("load", "N*m"), (panel,)))
    left, base = map(float, re.findall(r'<text x="([\d.]+)" y="([\d.]+)"[^>]*>3\.37 W<', drawn)[-1])
    (path,) = re.findall(r'<path d="([^"]+)"[^>]* data-line="power"', drawn)
    points = np.array(re.findall(r"-?[\d.]+", path), dtype=np.float64).reshape(-1, 2)
    box = Box(left, base - 11.0, left + text_width("3.37 W", SMALL), base + 3.0)
    assert distances([box], dense(points[:, 0], points[:, 1]))[0] >= 2.9


def test_curves_are_named_as_far_as_names_fit_and_a_legend_has_the_others() -> None:
    x = np.linspace(0.0, 1.0, 20)
    long = "A study whose name is far too long to stand at its curve in a chart of this width, even alone"
    lines = (Line("rising", x, x, PALETTE[0]), Line(long, x, 1.0 - x, PALETTE[1], 1))
    text = svg(Figure(Quantity("x", "1"), (Panel(Quantity("y", "1"), lines),)), width=500)
    at_curves = re.findall(r'<text[^>]*class="name"[^>]*>([^<]*)<', text)
    assert at_curves == ["rising"]
    assert text.count(">rising<") == 1, "not in the legend too"
    assert ">A study whose name" in text


def test_a_legend_has_a_name_that_one_of_the_panels_has_no_place_for() -> None:
    x = np.linspace(0.0, 1.0, 20)
    apart = [Line(name, x, slope * x, PALETTE[0], key=name) for name, slope in (("low", 1.0), ("high", 2.0))]
    together = [replace(line, y=x * (1.0 + 1e-4 * place), listed=False) for place, line in enumerate(apart)]
    panels = [Panel(Quantity(name, "1"), tuple(lines)) for name, lines in (("y", apart), ("z", together))]
    assert svg(Figure(Quantity("x", "1"), tuple(panels[:1]))).count(">low<") == 1
    assert svg(Figure(Quantity("x", "1"), tuple(panels))).count(">low<") == 2
