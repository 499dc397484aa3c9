"""Strips below curves and maps tell after how many excitation periods motions repeat."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.orders import looks_of, motion_name, motion_text, order_map
from sprag_study.service.figures.pictures import draw_map as paint_map
from sprag_study.service.figures.svg import picture_svg
from sprag_study.service.figures.svg_map import picture_map
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import CurveQuery, Curves, Map
from tests.service.figures.seen import seen
from tests.service.results.test_regimes import ORDERS, REGIMES, fetched, study

NAMES = ["coasting", "2 periods", "1 period", "irregular", "4 periods", "unsettled", "unsettled", None]
SPEED = "shaft.speed.mean"


def curves(lines: int = 1, y: tuple[str, ...] = (SPEED,)) -> Curves:
    one = study(8, lines)
    by = ("excitation.frequency",) if lines > 1 else ()
    return draw(select(one, CurveQuery("shaft.load", y, by)), fetched)


def order_of_two() -> Map:
    two = study(8, 2)
    axes = "shaft.load", "excitation.frequency", "regime.order"
    return draw_map(two, *axes, (), fetched)


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


def test_a_strip_has_the_colour_of_each_motion() -> None:
    for columns in (1, 2):
        figure = curves_figure([("", curves(2, (SPEED, "torque.mean")))], columns)
        drawn = picture_svg(figure, "")
        for colour, _ in figure.shown_looks.values():
            assert colour in drawn
        assert drawn.count("<title>20: 2 periods</title>") == columns
        assert seen(drawn).has("Regime; motion repeats after: periodic coasting irregular unsettled")


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
    assert len({colour for colour, _ in looks.values()}) == len(names)


def test_a_map_of_the_order_has_a_colour_for_each_number_of_periods() -> None:
    found = order_of_two()
    orders = order_map(found)
    assert orders is not None
    assert orders.names == [NAMES, NAMES]
    drawn = picture_map(found, "", contours=True)
    assert all(colour in drawn for colour in orders.colours)
    assert [text for text in seen(drawn).texts if text in {motion_text(name) for name in NAMES if name}] == [
        motion_text(name) for name in orders.looks
    ]  # fmt: skip


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_a_map_without_any_result_is_drawn(form: Any) -> None:
    found = order_of_two()
    nothing = replace(found, regimes=[[None] * 8] * 2, orders=[[None] * 8] * 2, values=np.full((2, 8), np.nan))
    assert paint_map(nothing, "", form)
