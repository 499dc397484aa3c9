"""Tables of the client: pandas, polars and quantities with the same numbers and units; small pictures in notebooks."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import polars as pl
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.answers.differing import differing
from sprag_study.service.client import AsyncClient, AsyncStudy, Client, Study, UnreachableError, with_units
from sprag_study.service.client.bars import bar_html, reporting
from sprag_study.service.client.sketch import sketch
from tests.service.conftest import PortalTransport, Service

SPEED, LOAD, HERTZ = "shaft.speed.mean", "shaft.load", "excitation.frequency"


@pytest.fixture
def client(service: Service, portal: BlockingPortal) -> Iterator[Client]:
    """A client of the service of the test."""
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        yield client


@pytest.fixture
def study(client: Client, service: Service, spec: dict[str, Any]) -> Study:
    """A study with rows."""
    study = client.submit(spec)
    service.fill(study.id)
    return study


def test_all_rows_have_units_and_endings(study: Study) -> None:
    table = study.table()
    assert table.attrs["units"][SPEED] == "rad/s"
    assert table.attrs["units"][LOAD] == "N*m"
    assert table.attrs["endings"] == {"ok": 8, "chatter": 1}
    other = study.polars()
    assert isinstance(other, pl.DataFrame)
    assert other[SPEED].null_count() == int(table[SPEED].isna().sum()) == 1
    np.testing.assert_array_equal(other[SPEED].to_numpy(), table[SPEED].to_numpy())
    quantities = with_units(table)
    assert str(quantities[SPEED].dtype) == "pint[radian / second][Float64]"
    in_rpm = quantities[SPEED].pint.to("rpm").pint.magnitude.to_numpy(float)
    np.testing.assert_allclose(in_rpm, table[SPEED] * 30.0 / np.pi, rtol=1e-12)
    assert quantities["case"].dtype == table["case"].dtype


def test_curves_in_every_kind_of_table(study: Study) -> None:
    curves = study.curves(LOAD, SPEED, by=HERTZ)
    frame = curves.to_pandas()
    np.testing.assert_array_equal(curves.to_polars()[SPEED].to_numpy(), frame[SPEED].to_numpy())
    assert str(curves.to_pint()[LOAD].dtype).startswith("pint[meter * newton]")


def test_a_picture_has_a_line_for_each_run_of_points(study: Study) -> None:
    shown = study.curves(LOAD, SPEED, by=HERTZ)._repr_html_()
    assert shown.startswith("<svg ")
    assert "shaft.speed.mean in rad/s against shaft.load in N*m" in shown
    assert shown.count("<polyline") == 4, "the case that failed is a gap in one of the three"
    shown = sketch("x <", "y", [([0.0, 1.0, 2.0, 3.0, 4.0], [0.0, 1.0, None, 3.0, float("nan")])])
    points = [run.split() for run in re.findall(r'points="([^"]*)"', shown)]
    assert [len(run) for run in points] == [2, 1]
    assert points[0][0] == "62.0,116.0", "the least values are at the corner of the axes"
    assert points[1][0].endswith(",10.0"), "the largest y is at the top"
    assert "x &lt;" in shown
    assert sketch("x", "y", [([1.0], [None])]) == "<p>y: no values</p>"


def test_a_study_shows_its_state_and_its_first_curves(study: Study, client: Client, spec: dict[str, Any]) -> None:
    shown = study._repr_html_()
    assert "finished" in shown
    assert "8 ok, 1 chatter" in shown
    assert "<svg " in shown
    waiting = client.submit(spec, fresh=True)._repr_html_()
    assert "queued" in waiting
    assert "<svg" not in waiting
    assert (
        Study(client, "st_0123456789abcdef")._repr_html_().startswith("<pre>Study(&#x27;st_0123456789abcdef&#x27;): ")
    )
    assert not hasattr(AsyncStudy, "_repr_html_"), "it cannot ask while it is shown"


def test_studies_side_by_side(study: Study, client: Client, service: Service, spec: dict[str, Any]) -> None:
    heavy = {**spec, "name": "heavy", "base": {**spec["base"], "shaft": {"inertia": "4e-3 kg*m^2", "load": 0.1}}}
    other = client.submit(heavy)
    service.fill(other.id)
    found = client.compare([study.id, other.id], LOAD, SPEED, by=HERTZ)
    assert found.names == (spec["name"], "heavy")
    assert found.inputs["/base/shaft/inertia"] == ("2e-3 kg*m^2", "4e-3 kg*m^2")
    assert "/base/excitation/frequency" not in found.inputs
    assert list(found.differences().loc["/base/shaft/inertia"]) == ["2e-3 kg*m^2", "4e-3 kg*m^2"]
    frame = found.to_pandas()
    assert list(frame["study"].unique()) == [spec["name"], "heavy"]
    assert len(frame) == 18
    assert found.units[SPEED] == "rad/s"
    assert found._repr_html_().count("<polyline") == 2
    # By default the curves are those that the page of the first study shows first.
    first, second = client.compare([study.id, other.id]).curves
    assert first.data == study.curves().data
    assert second.data["curves"][0]["at"] == first.data["curves"][0]["at"]
    assert [curve["by"] for curve in second.data["curves"]] == [curve["by"] for curve in first.data["curves"]]
    for wrong in ([study.id], [study.id] * 11):
        with pytest.raises(ValueError, match="2 to 10 studies"):
            client.compare(wrong)


def test_what_differs_between_specs() -> None:
    assert differing([{"name": "a", "x": {"y": [1, 2], "z": 1}}, {"name": "b", "x": {"y": [1, 3]}}]) == {
        "/x/y": ([1, 2], [1, 3]),
        "/x/z": (1, None),
    }
    assert differing([{"axes": [{"p/q": 1}]}, {"axes": [{"p/q": 2}]}]) == {"/axes/0/p~1q": (1, 2)}


def test_motions_of_a_case(client: Client, spec: dict[str, Any]) -> None:
    spec["run"] = {"duration": "12 periods", "window": ["6 periods", "12 periods"]}
    study = client.submit(spec)
    motion = study.trajectory(4, "6 periods", "12 periods", points=100)
    frame = motion.to_pandas()
    assert len(frame) == 100
    assert (frame.attrs["ending"], frame.attrs["units"]["times"]) == ("ok", "s")
    assert frame["times"].iloc[0] == pytest.approx(6 / 25.5)
    assert set(motion.data["states"]) <= set(frame)
    assert "<polyline" in motion._repr_html_()
    engagements = study.engagements(4)
    table = engagements.to_pandas()
    assert len(table) == len(engagements.data["engagements"]) > 0
    assert table.attrs["units"]["torque_max"] == "N*m"
    assert len(engagements.periods()) == 12


def test_a_notebook_has_a_bar_without_being_asked(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    from IPython import display

    shown: list[str] = []

    class Handle:
        def update(self, content: Any) -> None:
            shown.append(content.data)

    def show(content: Any, display_id: bool) -> Handle:
        assert display_id
        shown.append(content.data)
        return Handle()

    monkeypatch.setattr(display, "display", show)
    monkeypatch.setattr("sprag_study.service.client.bars.in_notebook", lambda: True)
    with reporting(None) as tell:
        tell(study.detail())
        tell(study.detail())
    assert shown == [bar_html(study.detail())] * 2
    assert '<progress value="9" max="9"></progress> 9 of 9 cases' in shown[0]
    with reporting(False) as tell:
        tell(study.detail())
    assert len(shown) == 2


def test_events_end_with_the_study(study: Study) -> None:
    (event,) = study.events()
    assert (event.kind, event.state, event.progress["done"]) == ("end", "finished", 9)


class Streams:
    """A service whose streams of events break off."""

    def __init__(self, streams: list[bytes | None]) -> None:
        self.streams = streams
        self.last: list[str | None] = []

    def __call__(self, request: httpx.Request) -> httpx.Response:
        """Answer the next request."""
        self.last.append(request.headers.get("Last-Event-ID"))
        stream = self.streams.pop(0)
        if stream is None:
            raise httpx.ConnectError("refused")
        return httpx.Response(200, content=stream)


def event(number: int, kind: str, state: str) -> bytes:
    return f'id: {number}\nevent: {kind}\ndata: {{"state": "{state}", "progress": {{}}}}\n\n'.encode()


def test_events_go_on_over_a_restart(monkeypatch: pytest.MonkeyPatch) -> None:
    scripted = Streams([event(1, "progress", "running") + b":\n\n", None, event(2, "end", "finished")])
    pauses: list[float] = []

    async def sleep(seconds: float) -> None:
        pauses.append(seconds)

    monkeypatch.setattr("sprag_study.service.client.asynchronous.following.asyncio.sleep", sleep)

    async def read() -> list[str]:
        async with AsyncClient("http://sprag", transport=httpx.MockTransport(scripted)) as client:
            return [event.state async for event in AsyncStudy(client, "st_1").events()]

    assert asyncio.run(read()) == ["running", "finished"]
    assert scripted.last == [None, "1", "1"]
    assert len(pauses) == 2


def test_a_stream_of_a_service_that_stays_away_is_an_error() -> None:
    async def read() -> None:
        async with AsyncClient("http://sprag", retry=0.0, transport=httpx.MockTransport(Streams([b""]))) as client:
            async for _ in AsyncStudy(client, "st_1").events():
                pass

    with pytest.raises(UnreachableError, match="breaks off"):
        asyncio.run(read())


def test_a_study_without_curves_shows_its_state(study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
    curves = Study.curves
    monkeypatch.setattr(Study, "curves", lambda one: curves(one, "no.such.axis"))
    shown = study._repr_html_()
    assert "8 ok, 1 chatter" in shown
    assert "<pre>" not in shown


class _Shortened(httpx.BaseTransport):
    """Gives, for the rows of a study, a well-formed file of another one that has fewer."""

    def __init__(self, inner: httpx.BaseTransport, other: str) -> None:
        self._inner, self._other = inner, other

    def handle_request(self, request: httpx.Request) -> httpx.Response:
        if request.url.path.endswith("/results"):
            request.url = request.url.copy_with(path=f"/api/v1/studies/{self._other}/results")
        return self._inner.handle_request(request)


def test_a_table_that_lacks_cases_is_an_error(
    study: Study, client: Client, service: Service, portal: BlockingPortal, spec: dict[str, Any], tmp_path: Any
) -> None:
    spec["axes"] = [{"path": LOAD, "values": [0.1, 0.2, 0.3]}, {"path": HERTZ, "values": [16, 20]}]
    other = client.submit(spec, fresh=True)
    service.fill(other.id)
    kept = tmp_path / "rows.csv"
    kept.write_text("kept")
    with Client("http://localhost", transport=_Shortened(PortalTransport(service.app, portal), other.id)) as short:
        found = short.study(study.id)
        asked: list[Any] = [found.table, found.polars, found.grid, lambda: found.export(kept)]
        asked += [lambda form=form: found.download(form) for form in ("csv", "json", "jsonl")]
        for ask in asked:
            with pytest.raises(UnreachableError, match=r"6 of 9 cases"):
                ask()
    assert not [path.name for path in tmp_path.iterdir() if path.suffix == ".part"]
    assert kept.read_text() == "kept"
    with client.rows(f"/studies/{study.id}", "csv") as pieces:
        assert sum(piece.count(b"\n") for piece in pieces) == 1 + 9
    assert study.export(kept).read_bytes() == study.download("csv")
