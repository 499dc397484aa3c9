"""The part of plotly's script that pages load: complete for the figures here, and smaller."""

from __future__ import annotations

import gzip
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

import sprag.service.http.web
from sprag.service.http.web import plotly_script as script
from sprag.service.http.web.plotly_script import TRACES, UnknownBundleError, plotly_script, reduced, whole_script

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser

    from tests.service.conftest import Service

#: A bundle of the same form: one trace that needs an ES module, one that needs a CommonJS module.
BUNDLE = (
    "/* licence */var L=(e,t,r)=>()=>{if(r)throw r[0];try{return e&&(t=e(e=0)),t}catch(i){throw r=[i],i}};"
    "var C=(e,t)=>()=>{try{return t||e((t={exports:{}}).exports,t),t.exports}catch(r){throw t=0,r}};"
    "var a1=C((e,m)=>{m.exports=1});function es(){return 2}var a2=L(()=>{});"
    'var b1=C((e,m)=>{a2();m.exports={moduleType:"trace",n:es(),name:"bar"}});'
    'var b2=C((e,m)=>{m.exports={moduleType:"trace",n:a3(),name:"pie"}});'
    "var a3=C(e=>{e.x=3});"
    "var c1=C((e,m)=>{m.exports=b1()});var c2=C((e,m)=>{m.exports=b2()});"
    "var z=C((e,m)=>{var P={register(x){this.all=x}};P.register([c1(),c2()]);m.exports=P});return z();"
)


def test_modules_out_of_reach_are_left_out_and_nothing_else_is_changed() -> None:
    kept = reduced(BUNDLE, ("bar",))
    gone = [
        'var b2=C((e,m)=>{m.exports={moduleType:"trace",n:a3(),name:"pie"}});',
        "var a3=C(e=>{e.x=3});",
        "var c2=C((e,m)=>{m.exports=b2()});",
    ]
    expected = BUNDLE.replace("[c1(),c2()]", "[c1()]")
    for part in gone:
        expected = expected.replace(part, "")
    assert kept == expected
    assert reduced(BUNDLE, ("bar", "pie")) == BUNDLE
    without = reduced(BUNDLE, ("pie",))
    assert "function es" not in without
    assert "a3=" in without


@pytest.mark.parametrize("text", ["", "var x=1;", BUNDLE.replace("register", "add"), BUNDLE.replace('"bar"', '"bars"')])
def test_another_bundle_is_refused(text: str) -> None:
    with pytest.raises(UnknownBundleError):
        reduced(text, ("bar",))


def test_an_unknown_bundle_is_sent_whole(monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture) -> None:
    monkeypatch.setattr(script, "whole_script", lambda: "var Plotly={};")
    assert plotly_script.__wrapped__().plain == b"var Plotly={};"
    assert "whole script of plotly" in caplog.text


def test_the_script_is_a_fourth_and_has_its_licences(service: Service) -> None:
    whole = whole_script()
    sent = service.http.get("/static/plotly.min.js", headers={"Accept-Encoding": "gzip"})
    assert sent.headers["content-type"].startswith("text/javascript")
    assert sent.text == plotly_script().plain.decode()
    assert len(sent.text) < len(whole) / 4
    assert len(plotly_script().packed) < 400_000
    assert gzip.decompress(plotly_script().packed) == plotly_script().plain
    assert "Licensed under the MIT license" in sent.text
    licences = whole[whole.index("/*", whole.rindex("register([")) :]
    assert licences.count("@license") > 3
    assert sent.text.endswith(licences)
    tag = sent.headers["etag"]
    again = service.http.get("/static/plotly.min.js", headers={"Accept-Encoding": "gzip", "If-None-Match": tag})
    assert again.status_code == 304
    plain = service.http.get("/static/plotly.min.js", headers={"Accept-Encoding": "identity"})
    assert (plain.text, "content-encoding" in plain.headers) == (sent.text, False)


def test_figures_use_these_traces_only() -> None:
    folder = Path(sprag.service.http.web.__file__).parent / "figures"
    named = {name for file in folder.glob("*.py") for name in re.findall(r'"type": "(\w+)"', file.read_text("utf-8"))}
    assert "contour" in (folder / "maps.py").read_text("utf-8")
    # The others are kinds of axes and of shapes.
    assert named - {"category", "line", "rect"} <= {"scatter", *TRACES}


@pytest.fixture
def empty_page(browser: Browser) -> Iterator[Any]:
    """A page with the script and nothing else; errors of scripts fail the test."""
    page = browser.new_page()
    errors: list[str] = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.set_content("<div id='plot'></div>")
    page.add_script_tag(content=plotly_script().plain.decode())
    yield page
    page.close()
    assert errors == []


def test_each_trace_is_drawn_by_it(empty_page: Any) -> None:
    grid = {"z": [[1, 2, 3], [2, 3, 4], [3, 5, 6]]}
    traces = {
        "scatter": {"x": [1, 2], "y": [3, 4], "mode": "lines+markers", "fill": "tozeroy"},
        "bar": {"x": [1, 2], "y": [3, 4], "orientation": "h", "marker": {"pattern": {"shape": "/"}}},
        "heatmap": grid,
        "contour": {**grid, "contours": {"showlabels": True}},
    }
    assert set(traces) == {"scatter", *TRACES}
    drawn = empty_page.evaluate(
        """async (traces) => {
          const found = {}, plot = document.getElementById("plot");
          for (const [type, trace] of Object.entries(traces)) {
            const shapes = [{ type: "rect", x0: 0, x1: 1, y0: 0, y1: 1 }];
            await Plotly.newPlot(plot, [{ type, ...trace }], { shapes, dragmode: "select" });
            await Plotly.relayout(plot, { "xaxis.range": [0, 3] });
            await Plotly.restyle(plot, { selectedpoints: [[0]] });
            const shapeless = !plot.querySelector(".trace, .heatmaplayer image, .contourlayer path");
            found[type] = plot._fullData[0].type + (shapeless ? " empty" : "");
          }
          return found;
        }""",
        traces,
    )
    assert drawn == {name: name for name in traces}
