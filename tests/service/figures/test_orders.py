"""Strips below curves and maps tell after how many excitation periods motions repeat."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from sprag.service.figures.curves import curves_figure
from sprag.service.figures.orders import looks_of, motion_name, order_map
from sprag.service.figures.pictures.curves import paint_figure, painting
from sprag.service.figures.pictures.maps import draw_map as paint_map
from sprag.service.http.web.figures.maps import map_figure
from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.results.curve_cases import draw, draw_map, select
from sprag.service.results.curves import CurveQuery, Curves, Map
from sprag.worker import models
from tests.service.results.test_regimes import ORDERS, REGIMES, fetched, study

NAMES = ["coasting", "2 periods", "1 period", "irregular", "4 periods", "unsettled", "unsettled", None]
SPEED = "shaft.speed.mean"


def curves(lines: int = 1, y: tuple[str, ...] = (SPEED,)) -> Curves:
    one = study(8, lines)
    by = ("excitation.frequency",) if lines > 1 else ()
    return draw(select(one, models.study_results(one), CurveQuery("shaft.load", y, by)), fetched)


def order_of_two() -> Map:
    two = study(8, 2)
    axes = "shaft.load", "excitation.frequency", "regime.order"
    return draw_map(two, models.study_results(two), *axes, (), fetched)


def test_a_motion_is_named_by_its_periods_or_its_regime() -> None:
    orders = [None if np.isnan(order) else int(order) for order in ORDERS]
    assert [motion_name(*pair) for pair in zip(REGIMES, orders, strict=True)] == NAMES


def test_a_strip_has_a_row_for_each_curve_and_runs_of_equal_motions() -> None:
    figure = curves_figure([("", curves(2))])
    x = np.linspace(0.0, 0.7, 8)
    middles = (x[1:] + x[:-1]) / 2.0
    borders = [x[0], *middles, x[-1]]
    assert list(figure.spans) == ["20", "21"]
    for spans in figure.spans.values():
        assert [name for name, _, _ in spans] == NAMES[:6]
        np.testing.assert_allclose([begin for _, begin, _ in spans], borders[:6])
        np.testing.assert_allclose([end for _, _, end in spans], [*borders[1:6], borders[7]])


def test_both_painters_draw_the_strip_in_the_same_colours() -> None:
    for columns in (1, 2):
        figure = curves_figure([("", curves(2, (SPEED, "torque.mean")))], columns)
        bars = [trace for trace in plotly_figure(figure)["data"] if trace["type"] == "bar"]
        assert len(bars) == columns * len(figure.shown_looks)
        told = [bar["name"] for bar in bars if bar["showlegend"]]
        assert [*told, *figure.regimes[1:]] == list(figure.shown_looks)
        picture = Figure()
        with painting():
            paint_figure(picture, figure, "")
        strips = [axes for axes in picture.axes if axes.collections]
        assert len(strips) == columns
        drawn = {to_hex(part.get_facecolor()[0]) for part in strips[0].collections}
        assert drawn == {bar["marker"]["color"] for bar in bars}


def test_strips_and_panels_of_a_page_share_their_x_axes() -> None:
    for columns in (1, 2):
        page = plotly_figure(curves_figure([("", curves(2, (SPEED, "torque.mean", "efficiency")))], columns))
        uses = {(trace["xaxis"], trace["yaxis"], trace["type"]) for trace in page["data"]}
        assert {x for x, _, _ in uses} == {"x", "x2"} if columns == 2 else {"x"}
        assert {(x, y) for x, y, kind in uses if kind == "bar"} == {(x, x.replace("x", "y")) for x, _, _ in uses}
        assert len({y for _, y, _ in uses}) == 3 + columns
        assert {f"{axis[0]}axis{axis[1:]}" for use in uses for axis in use[:2]} <= set(page["layout"])


def test_one_panel_has_one_strip() -> None:
    figure = curves_figure([("", curves(2, (SPEED,)))], 2)
    assert figure.columns == 1
    bars = {trace["xaxis"] for trace in plotly_figure(figure)["data"] if trace["type"] == "bar"}
    assert bars == {"x"}


def test_there_is_no_strip_without_orders_or_where_every_motion_repeats_after_one_period() -> None:
    plain = curves()
    same = tuple(replace(curve, regimes=["periodic"] * 8, orders=[1] * 8) for curve in plain.curves)
    none = tuple(replace(curve, regimes=None, orders=None) for curve in plain.curves)
    for changed in (same, none):
        assert not curves_figure([("", replace(plain, curves=changed))]).spans
    assert not curves_figure([("a", plain), ("b", plain)]).spans
    assert not curves_figure([("", curves(9))]).spans


def test_colours_tell_every_number_of_periods_and_regime_apart() -> None:
    names = [f"{order} periods" for order in range(2, 33)] + ["1 period", "held", "coasting", "irregular", "unsettled"]
    looks = looks_of(reversed(names))
    assert list(looks)[:3] == ["1 period", "2 periods", "3 periods"]
    assert list(looks)[-4:] == ["held", "coasting", "irregular", "unsettled"]
    assert len({colour for colour, _, _ in looks.values()}) == len(names)


def test_a_map_of_the_order_has_a_colour_for_each_number_of_periods() -> None:
    found = order_of_two()
    orders = order_map(found)
    assert orders is not None
    assert orders.names == [NAMES, NAMES]
    trace, *entries = map_figure(found, contour=True)["data"]
    names = [entry["name"] for entry in entries]
    assert trace["type"] == "heatmap"
    assert [[None if place is None else names[int(place)] for place in row] for row in trace["z"]] == [NAMES, NAMES]
    steps: list[Any] = trace["colorscale"]
    assert [colour for _, colour in steps[::2]] == [colour for _, colour in steps[1::2]] == orders.colours
    assert [entry["marker"]["color"] for entry in entries] == orders.colours
    assert orders.colours[1].encode() in paint_map(found, "", "svg")


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_a_map_without_any_result_is_drawn(form: Any) -> None:
    found = order_of_two()
    nothing = replace(found, regimes=[[None] * 8] * 2, orders=[[None] * 8] * 2, values=np.full((2, 8), np.nan))
    assert map_figure(nothing, contour=False)["data"][0]["z"] == [[None] * 8] * 2
    assert paint_map(nothing, "", form)
