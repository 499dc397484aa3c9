"""Ribbons and yields by both clients and by the commands are those of the service."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any

import httpx
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.cli import remote
from sprag_study.service.client import AsyncClient, Client
from tests.conftest import Finished
from tests.service.conftest import PortalTransport, Service
from tests.service.results.tolerances.conftest import SPEC, finish

CONDITION = "speed >= 90 % of nominal"


async def asynchronous(service: Service, study_id: str) -> Any:
    """The answers by the other client."""
    async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
        study = await client.study(study_id)
        return (await study.ribbon("load", "speed")).data, (await study.yields(CONDITION, "load", worst=3)).data


def test_both_clients_give_tables(service: Service, portal: BlockingPortal) -> None:
    study_id = finish(service, {**SPEC, "drives": 128})
    own = f"/studies/{study_id}"
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        ribbon, found = study.ribbon("load", "speed", quantiles=(0.1, 0.9)), study.yields(CONDITION, "load", worst=3)
    assert ribbon.data == service.get(f"{own}/ribbon", x="load", y="speed", quantile=[0.1, 0.9])
    assert found.data == service.get(f"{own}/yield", condition=CONDITION, x="load", worst=3)
    table = ribbon.to_pandas()
    speed = ribbon.data["lines"][0]["results"]["speed"]
    assert table[table["quantile"] == 0.9]["value"].tolist() == speed["values"][1]
    assert table["load"].tolist() == [load for load in (0.0, 2.0, 4.0, 6.0, 8.0) for _ in range(2)]
    assert table.attrs["units"] == {"load": "m"}
    assert ribbon.causes()["share"].tolist() == [item["share"] for item in speed["causes"]["shares"]]
    line = found.data["lines"][0]
    assert found.to_pandas()["yield"].tolist() == [share["value"] for share in line["each"]]
    assert found.worst()["margin"].tolist() == [one["margin"] for one in line["worst"]]
    assert set(found.causes()["tolerance"]) == {"first", "second", "third"}
    both = portal.call(partial(asynchronous, service, study_id))
    assert both == (service.get(f"{own}/ribbon", x="load", y="speed"), found.data)


@pytest.mark.usefixtures("terminal")
def test_the_commands_show_and_write_them(
    service: Service,
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
) -> None:
    connected(remote)
    study_id = finish(service, {**SPEC, "drives": 128})
    own = f"/studies/{study_id}"
    file = tmp_path / "ribbon.csv"
    shown = sprag("show", study_id, "ribbon", "--y", "speed", "--quantile", "10%", "--quantile", 0.9, "-o", file)
    assert shown.code == 0, shown.err
    found = service.get(f"{own}/ribbon", y="speed", quantile=[0.1, 0.9])
    assert {"nominal", "10", "90", "failed"} <= set(shown.out.split())
    with file.open(newline="") as opened:
        rows = [float(row["speed 10 %"]) for row in csv.DictReader(opened)]
    assert rows == found["lines"][0]["results"]["speed"]["values"][0]
    assert sprag("show", study_id, "ribbon", "--y", "speed", "--quantile", "10%", "-o", file, "--units", "mm").code == 0
    with file.open(newline="") as opened:
        assert [float(row["speed 10 % [mm]"]) for row in csv.DictReader(opened)] == pytest.approx(
            [1e3 * v for v in rows]
        )
    assert sprag("show", study_id, "yield", CONDITION, "-o", file, "--units", "mm").code == 0
    assert "load [mm]" in file.read_text().splitlines()[0]
    assert json.loads(sprag("show", study_id, "ribbon", "--y", "speed", "--json").out)["quantiles"] == [0.05, 0.5, 0.95]
    shown = sprag("show", study_id, "yield", CONDITION, "speed <= 70 m", "--worst", 2)
    line = service.get(f"{own}/yield", condition=[CONDITION, "speed <= 70 m"])["lines"][0]
    assert f"at every place: {100 * line['all']['value']:.1f} %" in shown.err
    assert str(line["worst"][0]["drive"]) in shown.out.split()
    picture = tmp_path / "yield.svg"
    assert sprag("show", study_id, "yield", CONDITION, "-o", picture).code == 0
    assert picture.read_bytes().startswith(b"<?xml")
    assert sprag("show", study_id, "ribbon", "-o", tmp_path / "ribbon.doc").code == 2
