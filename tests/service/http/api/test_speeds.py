"""All steady cycles of a case over HTTP, on its page, through the client and by the command."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from typing import Any

import pytest
from pydantic import TypeAdapter

from sprag_study.service.answers.speeds import SteadySpeeds
from sprag_study.service.client import Client
from tests.service.conftest import API, PortalTransport, Service

#: A motor with a saddle: its torque is the one of the load at 19, 37 and 135 rad/s.
ROWS = [[0, 90], [10, 70], [25, 40], [100, 115], [140, 43], [157, 0]]
SADDLE: dict[str, Any] = {
    "sprag": 1, "model": "machine-shaft", "name": "A motor with a saddle",
    "base": {
        "balance": "motor",
        "drive": {"inertia": 3, "motor": {"kind": "table", "interpolation": "linear", "table": ROWS}},
        "operation": {"quantity": "torque", "value": 52},
    },
}  # fmt: skip


def asked(service: Service, study_id: str, query: str = "") -> Any:
    return service.http.get(f"{API}/studies/{study_id}/cases/0/speeds?{query}")


def test_the_cycles_are_the_same_everywhere(service: Service, portal: Any, sprag: Any, tmp_path: Path) -> None:
    saddle = service.submit(SADDLE)
    response = asked(service, saddle)
    assert response.status_code == 200, response.text
    body = response.json()
    TypeAdapter(SteadySpeeds).validate_python(body)
    assert [cycle["mean"] for cycle in body["cycles"]] == pytest.approx([19.0, 37.0, 135.0])
    assert [cycle["stable"] for cycle in body["cycles"]] == [True, False, True]
    assert (body["of_case"], body["stops_below"], body["runs_away_above"]) == (2, None, None)
    assert (body["cycles"][1]["low"], body["cycles"][2]["high"]) == (None, None)
    assert len(body["speeds"]) == len(body["changes"]) > 100
    rows = list(csv.DictReader(io.StringIO(asked(service, saddle, "format=csv").text)))
    assert [row["stable"] for row in rows] == ["true", "false", "true"]
    assert float(rows[0]["high"]) == body["cycles"][1]["start"]
    assert asked(service, saddle, "format=svg").content.startswith(b"<?xml")
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        assert client.study(saddle).speeds(0) == body
    assert service.get(f"/studies/{saddle}/cases/0")["links"]["speeds"].endswith("/cases/0/speeds")
    page = service.http.get(f"/studies/{saddle}/cases/0?show=speeds").text
    assert "The shaft turns steadily at 181.4 rpm, to which it comes from speeds below 353.3 rpm." in page
    assert "The results of the case are about the one at 1289 rpm." in page
    spec = tmp_path / "saddle.json"
    spec.write_text(json.dumps(SADDLE))
    done = sprag("show", spec, "speeds", "--load", "2", "-o", tmp_path / "speeds.csv")
    # 104 N*m: near the speed without load only, and at the peak of the saddle's far side, where it is unstable.
    assert "The shaft turns steadily at 106.1 rad/s, to which it comes from speeds above 89 rad/s." in done.err
    assert "From speeds below 89 rad/s the shaft comes to a standstill." in done.err


def test_other_machines_have_no_speeds_of_their_own(service: Service) -> None:
    press = SADDLE | {"base": {"mean_speed": 10, "drive": {"inertia": 3}, "operation": SADDLE["base"]["operation"]}}
    study_id = service.submit(press)
    refused = asked(service, study_id)
    assert refused.status_code == 404
    assert "Only machines with a motor" in refused.text, refused.text
    assert "show=speeds" not in service.http.get(f"/studies/{study_id}/cases/0").text
    refused = asked(service, service.submit(SADDLE), "load=-1")
    assert refused.json()["errors"][0]["allowed"] == "0 to 1e+06"
