"""Answers over HTTP, by both clients, by the command, and on the page of a study."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import numpy as np
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.cli import remote
from sprag_study.service.cli.console import cell_text
from sprag_study.service.client import AsyncClient, Client
from sprag_study.service.http.web.sheet import chart
from tests.conftest import Finished
from tests.service.conftest import API, PortalTransport, Service
from tests.service.figures.seen import chart_of

AXES = [
    {"path": "excitation.frequency", "linspace": ["20 Hz", "30 Hz", 11]},
    {"path": "shaft.load", "values": [0, 0.1, 0.2, 0.4, 0.8]},
]


@pytest.fixture
def filled(service: Service, spec: dict[str, Any]) -> tuple[Service, str]:
    """A finished study of eleven frequencies with made-up rows, of which six are drawn."""
    study_id = service.submit({**spec, "axes": AXES})
    service.fill(study_id)
    return service, study_id


async def asynchronous(service: Service, study_id: str) -> Any:
    """Answers by the other client."""
    async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
        return await (await client.study(study_id)).answers("200 N*mm", of={"excitation.frequency": ["25 Hz"]})


def test_answers_are_those_of_the_rows(filled: tuple[Service, str], portal: BlockingPortal) -> None:
    service, study_id = filled
    found = service.get(f"/studies/{study_id}/answers", point="0.2 N*m")
    assert (found["x"], found["unit"], found["point"], len(found["curves"])) == ("shaft.load", "N*m", 0.2, 6)
    block = service.store.rows.block(study_id)
    column = [info.name for info in block.infos].index("power.useful.mean")
    ok = np.array([ending == "ok" for ending in block.endings])
    best = int(np.nanargmax(np.where(ok, block.values[:, column], np.nan)))
    (power,) = [item for item in found["overall"] if item["name"] == "largest_power"]
    assert (power["value"], power["cases"]) == (block.values[best, column], [int(block.cases[best])])
    assert power["parameters"] == service.get(f"/studies/{study_id}/cases/{best}")["parameters"]
    for curve in found["curves"]:
        case = round(curve["by"]["excitation.frequency"] - 20.0) * 5 + 2
        (here,) = [item for item in curve["working_point"] if item["name"] == "torque.mean"]
        row = service.get(f"/studies/{study_id}/cases/{case}")
        assert here["value"] == row["results"]["torque.mean"]
        assert here["cases"] == ([case] if row["ending"] == "ok" else here["cases"])
    table = service.http.get(f"{API}/studies/{study_id}/answers?format=csv&point=0.2").text
    rows = list(csv.DictReader(io.StringIO(table)))
    assert len(rows) == len(found["overall"]) + sum(
        len(c["answers"]) + len(c["working_point"]) for c in found["curves"]
    )
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        one = client.study(study_id).answers("200 N*mm", of={"excitation.frequency": ["25 Hz"]})
        lines = client.study(study_id).curves("shaft.load", "torque.mean", by="excitation.frequency",
                                              of={"excitation.frequency": [21, "22 Hz"]})  # fmt: skip
    assert [curve["by"] for curve in one["curves"]] == [{"excitation.frequency": 25.0}]
    assert [curve["by"]["excitation.frequency"] for curve in lines.data["curves"]] == [21.0, 22.0]
    assert portal.call(partial(asynchronous, service, study_id)) == one


@pytest.mark.parametrize(
    ("query", "parameter", "code"),
    [
        ("point=3 mm", "point", "wrong-unit"),
        ("of=shaft.load=0.1", "by", "repeated"),
        ("of=excitation.frequency=20.5", "of", "unknown-value"),
        ("of=excitation.frequency", "of", "invalid-text"),
        ("y=torque.mean", "y", "unknown-field"),
    ],
)
def test_wrong_questions_name_what_is_wrong(filled: tuple[Service, str], query: str, parameter: str, code: str) -> None:
    service, study_id = filled
    refused = service.http.get(f"{API}/studies/{study_id}/answers?{query}")
    assert refused.status_code == 422
    (fault,) = refused.json()["errors"]
    assert (fault["parameter"], fault["code"]) == (parameter, code)


@pytest.mark.usefixtures("terminal")
def test_the_command_shows_them_and_writes_them(
    filled: tuple[Service, str],
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
) -> None:
    connected(remote)
    service, study_id = filled
    shown = sprag("show", study_id, "answers", "--point", "0.2 N*m", "-o", tmp_path / "answers.svg")
    assert shown.code == 0
    assert shown.out.count("Largest useful power") == 6 + 1
    assert "among all cases" in shown.out
    assert "working point" not in shown.err
    assert (tmp_path / "answers.svg").read_text().startswith("<?xml")
    told = json.loads(sprag("show", study_id, "answers", "--point", "0.2 N*m", "--json").out)
    assert told == service.get(f"/studies/{study_id}/answers", point="0.2 N*m")
    # What is beyond the cases that were run is no number.
    beyond = [item["value"] for curve in told["curves"] for item in curve["answers"] if item["above"]]
    assert beyond
    assert shown.out.count("> ") == len(beyond)
    assert all(f"> {cell_text(value)} " in shown.out for value in beyond)


def test_the_page_says_the_answers_first(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    page = service.http.get(f"/studies/{study_id}?point=0.2&curve=22 Hz")
    assert page.status_code == 200
    text = page.text
    assert (
        text.index('class="say')
        < text.index('class="facts"')
        < text.index('id="chart"')
        < text.index("How cases ended")
    )
    titles = re.findall(r"<div><dt>([^<]+)</dt>", text)
    assert titles == ["No-load speed", "Largest useful power", "Best efficiency", "Stall torque"]
    assert '<option value="22 Hz" selected>22 Hz</option>' in text
    assert "6 of 11 curves" in text
    found = service.get(f"/studies/{study_id}/answers", point="0.2")
    (chosen,) = [curve for curve in found["curves"] if curve["by"] == {"excitation.frequency": 22.0}]
    for item in chosen["answers"]:
        if item["cases"]:
            assert f'href="/studies/{study_id}/cases/{item["cases"][0]}"' in text
    for picture in re.findall(r'href="([^"]+format=svg)"', text):
        assert service.http.get(picture.replace("&amp;", "&")).text.startswith("<")


def test_a_long_curve_is_not_told_case_by_case(filled: tuple[Service, str], monkeypatch: pytest.MonkeyPatch) -> None:
    service, study_id = filled
    monkeypatch.setattr(chart, "_TOLD", 4)
    monkeypatch.setattr(chart, "case_sentence", None)
    page = service.http.get(f"/studies/{study_id}")
    assert page.status_code == 200
    assert "data-cases='[]'" in page.text


@pytest.mark.parametrize("text", ["3 mm", "abc"])
def test_the_page_says_why_a_point_is_none(filled: tuple[Service, str], text: str) -> None:
    service, study_id = filled
    page = service.http.get(f"/studies/{study_id}?point={text}")
    assert page.status_code == 422
    assert "<code>point</code>" in page.text
    assert 'class="say' in page.text


def test_a_chosen_family_is_in_the_address_of_curves(filled: tuple[Service, str]) -> None:
    service, study_id = filled
    values = "&".join(f"of=excitation.frequency={value}" for value in (20, 23, 30))
    former = service.http.get(f"/studies/{study_id}/curves?{values}", follow_redirects=False)
    assert former.status_code == 308
    text = service.http.get(former.headers["location"]).text
    assert "3 of 11 curves" in text
    panel, _ = chart_of(text).panels
    assert sorted(curve.name for curve in panel.curves) == ["20", "23", "30"]
    every = service.http.get(f"/studies/{study_id}?x=shaft.load&by=excitation.frequency&every=1").text
    assert "11 of 11 curves" in every
