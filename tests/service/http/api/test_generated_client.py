"""A client that openapi-python-client generates from the service's own description works as it is."""

from __future__ import annotations

import importlib
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.http.api.examples import EXTENSION_AXES
from tests.service.conftest import PortalTransport, Service
from tests.service.timed_spec import SPEC

PACKAGE = "generated_sprag"


@pytest.fixture
def generated(service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Any]:
    """A function that imports modules of the generated client."""
    (tmp_path / "openapi.json").write_text(json.dumps(service.http.get("/openapi.json").json()))
    (tmp_path / "config.yml").write_text("post_hooks: []\n")
    command = ["generate", "--path", "openapi.json", "--config", "config.yml", "--meta", "none"]
    done = subprocess.run(
        [sys.executable, "-m", "openapi_python_client", *command, "--output-path", PACKAGE],
        cwd=tmp_path, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout + done.stderr
    # The generator knows no TOML and says so; nothing else may be missing.
    warnings = [line for line in done.stdout.splitlines() if "WARNING" in line]
    assert len(warnings) == done.stdout.count("Unsupported content type application/toml")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield lambda name: importlib.import_module(f"{PACKAGE}.{name}")
    for name in [name for name in sys.modules if name.partition(".")[0] == PACKAGE]:
        del sys.modules[name]


def test_a_generated_client_submits_reads_and_understands_problems(
    service: Service, generated: Any, portal: BlockingPortal
) -> None:
    transport = PortalTransport(service.app, portal)
    client = generated("client").Client(base_url="http://localhost", httpx_args={"transport": transport})
    models = generated("models")
    spec = models.Spec.from_dict(SPEC)
    made = generated("api.studies.create_study").sync(client=client, body=spec, idempotency_key="generated")
    assert isinstance(made, models.StudySummary)
    assert service.store.studies.spec(made.id) == SPEC
    rows = service.fill(made.id)

    study = generated("api.studies.get_study").sync(made.id, client=client)
    assert (study.state, study.progress.done) == ("finished", made.cases)
    page = generated("api.studies.list_studies").sync(client=client)
    assert [item.id for item in page.studies] == [made.id]

    curves = generated("api.results.get_curves").sync(
        made.id, client=client, x="shaft.load", y=["shaft.speed.mean"], by=["excitation.frequency"]
    )
    first = curves.curves[0]
    assert first.y["shaft.speed.mean"] == rows.values[:3, 0].tolist()
    assert first.by.to_dict() == {"excitation.frequency": 16.0}
    cases = generated("api.cases.list_cases").sync(made.id, client=client, page_size=2)
    assert cases.cases[1].results["shaft.speed.mean"] == rows.values[1, 0]
    effects = generated("api.results.get_sensitivity").sync(made.id, client=client, y=["torque.max"])
    assert effects.results[0].result == "torque.max"
    csv = generated("api.results.get_results").sync_detailed(made.id, client=client, format_="csv")
    assert csv.content.count(b"\n") == made.cases + 1

    larger = generated("api.studies.extend_study").sync(
        made.id, client=client, body=models.Extension.from_dict(EXTENSION_AXES)
    )
    assert larger.cases == made.cases + 6

    wrong = {**SPEC, "base": {**SPEC["base"], "shaft": {"inertia": -1}}}
    problem = generated("api.studies.preview_study").sync_detailed(client=client, body=models.Spec.from_dict(wrong))
    document = json.loads(problem.content)
    assert (problem.status_code, document["errors"][0]["pointer"]) == (422, "/base/shaft/inertia")
    models_known = generated("api.models.list_models").sync(client=client)
    assert models_known.models[0].name == "vibration-drive"
