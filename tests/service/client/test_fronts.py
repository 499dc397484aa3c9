"""The designs of a study with a goal, by both clients and by the command."""

from __future__ import annotations

import csv
import json
import re
import sys
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
from tests.service.searching import search


async def asynchronous(service: Service, study_id: str) -> Any:
    """The exact front by the other client."""
    async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as client:
        return await (await client.study(study_id)).front(limit=3, exact=True)


def test_both_clients_give_the_designs(service: Service, portal: BlockingPortal) -> None:
    study_id = search(service)
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        assert study.front() == service.get(f"/studies/{study_id}/front")
        exact = study.front(limit=3, exact=True)
    assert len(exact["designs"]) == 3
    assert exact["designs"][0]["exact"]
    assert portal.call(partial(asynchronous, service, study_id)) == exact


def test_the_command_shows_the_best_designs(
    service: Service,
    sprag: Callable[..., Finished],
    connected: Callable[[ModuleType], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connected(remote)
    study_id = search(service)
    found = service.get(f"/studies/{study_id}/front")
    shown = sprag("show", study_id, "front", "--limit", 3, "-o", tmp_path / "front.csv")
    assert shown.code == 0
    counts, designs = found["counts"], found["designs"]
    rows = list(csv.DictReader(shown.out.splitlines(), delimiter="\t"))
    ranks = [[item["design"], item["rank"]] for item in designs[:3]]
    assert [[int(row["design"]), int(row["rank"])] for row in rows] == ranks
    with monkeypatch.context() as people:
        people.setattr(sys.stdout, "isatty", lambda: True)
        for name, value in {"TERM": "dumb", "COLUMNS": "500", "LINES": "100"}.items():
            people.setenv(name, value)
        table = sprag("show", study_id, "front", "--limit", 3).out
    assert table.strip().startswith(f"{counts['known']} designs, {counts['feasible']} feasible")
    assert {"amplitude_x", "[rad/s]"} <= {*re.split(r"[\s.]+", table)}
    with (tmp_path / "front.csv").open(newline="") as file:
        assert len(list(csv.DictReader(file))) == counts["known"]
    told = json.loads(sprag("show", study_id, "front", "--exact", "--json").out)
    assert told == service.get(f"/studies/{study_id}/front", exact=True, limit=20)
    assert sprag("show", study_id, "front", "-o", tmp_path / "front.doc").code == 2
