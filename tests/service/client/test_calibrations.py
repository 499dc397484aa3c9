"""Calibrations by both clients and by the commands."""

from __future__ import annotations

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
from tests.service.calibrating import calibration, spec_of
from tests.service.conftest import PortalTransport, Service


async def asynchronous(service: Service, study_id: str) -> Any:
    """The calibration by the other client."""
    async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
        return await (await client.study(study_id)).calibration()


@pytest.mark.usefixtures("terminal")
def test_both_clients_and_the_command_give_a_calibration(
    service: Service,
    portal: BlockingPortal,
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
) -> None:
    study_id = calibration(service)
    found = service.get(f"/studies/{study_id}/calibration")
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(study_id).calibration() == found
    assert portal.call(partial(asynchronous, service, study_id)) == found

    connected(remote)
    shown = sprag("show", study_id, "calibration", "-o", tmp_path / "points.csv")
    assert shown.code == 0
    for sentence in found["sentences"]:
        assert sentence in shown.out
    assert "pendulums.0.damping" in shown.out
    assert len((tmp_path / "points.csv").read_text().splitlines()) == 11
    assert json.loads(sprag("show", study_id, "calibration", "--json").out) == found
    assert sprag("show", study_id, "calibration", "-o", tmp_path / "points.doc").code == 2


@pytest.mark.parametrize(("change", "code"), [("none", "required"), ("points", "unequal-lengths")])
def test_calibrate_names_what_is_wrong(sprag: Callable[..., Finished], tmp_path: Path, change: str, code: str) -> None:
    spec, points = spec_of(), tmp_path / "points.csv"
    points.write_text("shaft.load,shaft.speed.mean\n0.1,20\n0.2\n")
    if change == "none":
        del spec["calibrate"]
    (tmp_path / "spec.json").write_text(json.dumps(spec))
    failed = sprag("show", tmp_path / "spec.json", "calibration", "--measured", points, "--json")
    assert failed.code == 2
    assert [problem["code"] for problem in json.loads(failed.err)["problems"]] == [code]
