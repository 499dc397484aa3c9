"""A model that this file alone knows goes through everything: spec, HTTP, worker, storage, curves, pages, exports."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine import Ending
from sprag_study.engine.catalogue import Parameter, ResultInfo
from sprag_study.engine.outcome import Trajectory
from sprag_study.service.client import Client
from sprag_study.service.formats import MEDIA_TYPES
from sprag_study.service.http.web.form.fields import FORM_MODEL
from sprag_study.service.http.web.form.machine import blocks
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.settings import Settings
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.schema.document import spec_schema
from sprag_study.service.storage.part import SystemClock
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models.common import ChunkResult, ChunkTask, Extent, KernelShape, chunk_result
from sprag_study.worker.models.model import Model
from sprag_study.worker.models.presentation import Presentation
from sprag_study.worker.models.registry import model_of
from sprag_study.worker.study import Study
from tests.service.conftest import PortalTransport
from tests.service.http.web.controls import Controls
from tests.service.registered import create_table, registered

if TYPE_CHECKING:
    from pathlib import Path

    from anyio.from_thread import BlockingPortal

    from tests.service.conftest import Service

NAME = "damped-oscillator"
END = 2.0
PARAMETERS = (
    Parameter("body.mass", "m", "kg", 0.0, 1e3, True, None, "mass of the body"),
    Parameter("body.spring_rate", "c", "N/m", 0.0, 1e9, True, None, "rate of its spring"),
    Parameter("damping", "D", "1", 0.0, 0.99, False, 0.05, "damping ratio"),
)
RESULTS = (
    ResultInfo("frequency", "Hz", "frequency of the damped oscillation"),
    ResultInfo("displacement.end", "m", "displacement after 2 s of a body that was let go at 1 m"),
    ResultInfo("swings", "1", "whole oscillations in 2 s", "count"),
)


def displacement(columns: dict[str, Any], times: Any) -> Any:
    """Closed form for x(0) = 1 m, x'(0) = 0."""
    speed, ratio = np.sqrt(columns["body.spring_rate"] / columns["body.mass"]), columns["damping"]
    damped = speed * np.sqrt(1.0 - np.square(ratio))
    sine = ratio * speed / damped * np.sin(damped * times)
    return np.exp(-ratio * speed * times) * (np.cos(damped * times) + sine)


class DampedOscillator(Model):
    """A body on a spring with a damper."""

    name = NAME
    endings = frozenset({Ending.DIVERGED})

    presentation = Presentation(drawn=("displacement.end",), heading="What a spring does", columns=("swings",))

    def parameters(self) -> tuple[Parameter, ...]:
        return PARAMETERS

    def results(self, variant: str) -> tuple[ResultInfo, ...]:
        return RESULTS

    def shape_of(self, study: Study) -> KernelShape:
        return KernelShape(NAME)

    def run(self, task: ChunkTask) -> ChunkResult:
        speed = np.sqrt(task.columns["body.spring_rate"] / task.columns["body.mass"])
        frequency = speed * np.sqrt(1.0 - np.square(task.columns["damping"])) / (2.0 * math.pi)
        results = (frequency, displacement(task.columns, END), np.floor(frequency * END))
        values = np.column_stack([np.broadcast_to(result, task.count) for result in results])
        return chunk_result(task.first, np.zeros(task.count, dtype=np.int8), [""] * task.count, values)

    def extent(self, study: Study, case: int) -> Extent:
        return Extent("time", "s", END, 1.0)

    def trajectory(self, study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
        times = np.linspace(start, end, points)
        values = displacement({**study.base, **study.case_parameters(case)}, times)
        return Trajectory(times, ("displacement",), ("m",), values[:, None], {}, Ending.OK)

    def estimate_seconds_per_case(self, study: Study) -> float:
        return 1e-6


SPEC: dict[str, Any] = {
    "sprag": 1,
    "model": NAME,
    "name": "a toy",
    "base": {"body": {"mass": "500 g", "spring_rate": 200}, "damping": 0.1},
    "axes": [
        {"path": "body.spring_rate", "linspace": [100, 400, 4]},
        {"path": "body.mass", "values": [0.5, 1.0, 2.0]},
    ],
}


@pytest.fixture(autouse=True)
def toy() -> Iterator[None]:
    """The model, for the time of a test."""
    with registered(DampedOscillator()):
        yield


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Settings of a service whose database has the model's table, as a migration would make it."""
    create_table(settings, NAME)
    return settings


@pytest.fixture
def finished(service: Service) -> tuple[Service, str]:
    """The study, submitted by HTTP and run by the dispatcher."""
    study_id = service.submit(SPEC)
    store = service.store
    Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study_id).state.terminal)
    return service, study_id


def expected(study: Study) -> NDArray[np.float64]:
    """Displacements of every case."""
    return np.asarray(displacement({**study.base, **study.columns(range(study.cases))}, END))


def test_the_spec_is_read_by_the_catalogue_alone() -> None:
    parsed = parse_spec(SPEC)
    assert parsed.study.base == {"body.mass": 0.5, "body.spring_rate": 200.0, "damping": 0.1}
    assert parsed.study.run == {}
    wider = parse_extended(SPEC, parsed.study, {"axes": [{"path": "damping", "values": [0.2]}]}).study
    assert wider.shape == (4, 3, 2)


@pytest.mark.parametrize(
    ("changes", "pointer", "code"),
    [
        ({"base": None}, "/base", "required"),
        ({"base": {"body": 3}}, "/base/body", "wrong-type"),
        ({"base": {"body": {"mass": 1, "spring_rate": 2, "sprng": 3}}}, "/base/body/sprng", "unknown-field"),
        ({"base": {"body": {"mass": 0, "spring_rate": 2}}}, "/base/body/mass", "out-of-range"),
        ({"base": {"body": {"mass": 1}}}, "/base/body/spring_rate", "required"),
        ({"run": {"duration": 3}}, "/run/duration", "not-used"),
        ({"axes": [{"path": "body.mas", "values": [1]}]}, "/axes/0/path", "invalid-path"),
    ],
)
def test_what_is_wrong_with_the_spec_is_told_where_it_is(changes: dict[str, Any], pointer: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec(SPEC | changes)
    assert (pointer, code) in [(fault.where, fault.code) for fault in caught.value.faults]


def test_the_catalogues_list_it(service: Service) -> None:
    listed = service.get(f"/models/{NAME}")
    assert [entry["path"] for entry in listed["parameters"]] == [entry.path for entry in PARAMETERS]
    assert [entry["name"] for entry in listed["results"]] == [info.name for info in RESULTS]
    assert "diverged" in listed["endings"]
    assert "chatter" not in listed["endings"]
    rules = spec_schema()["allOf"]
    own = next(rule for rule in rules if rule["if"]["properties"]["model"]["const"] == NAME)
    assert own["then"]["properties"]["base"]["required"] == ["body"]


def names_by_title(model: str) -> dict[str, list[str]]:
    """Titles of the blocks of the form with the names of their fields."""
    return {block.title: [entry.name for entry in block.entries] for block in blocks({"model": model})}


def test_the_form_has_a_section_for_each_part_of_a_machine() -> None:
    assert names_by_title(NAME) == {
        "Body": ["/base/body/mass", "/base/body/spring_rate"],
        "Other parameters": ["/base/damping"],
    }


def test_the_form_of_an_unknown_model_says_which_there_are(service: Service) -> None:
    answer = service.http.get("/new?model=perpetual-motion")
    assert answer.status_code == 404
    assert f"vibration-drive, machine-shaft, {NAME}" in answer.text


def test_a_study_without_fields_in_the_form_is_text_and_the_page_says_so(service: Service) -> None:
    said = "The form has no fields for all of this study"
    assert said not in service.http.get("/new?mode=text").text
    several = SPEC | {"axes": [{"points": f"{path}\n1\n2\n"} for path in ("body.mass", "body.spring_rate")]}
    page = service.http.get(f"/new?clone={service.submit(several)}").text
    assert said in page
    assert Controls(page).values["/text"].startswith('{\n  "sprag": 1,\n  "model": "damped-oscillator"')


def test_its_form_is_filled_in_and_submitted(service: Service) -> None:
    page = service.http.get(f"/new?model={NAME}").text
    shown = Controls(page).values
    assert {"/base/body/mass", "/base/body/spring_rate", "/base/damping", "axes"} <= set(shown)
    assert not {"pendulums", "/run/until"} & set(shown)
    values = values_of(SPEC)
    assert parse_spec(spec_of(values)[0]).study == parse_spec(SPEC).study
    kept = {name: text for name, text in shown.items() if not name.startswith(("unit:", "ticks:"))}
    answer = service.http.post("/new", data={**kept, **values, "do": "submit"}, follow_redirects=False)
    assert answer.status_code == 303
    study = service.store.studies.study(answer.headers["location"].rpartition("/")[2])
    assert study.physics_hash("1") == parse_spec(SPEC).study.physics_hash("1")


def test_its_machine_is_computed_while_it_is_drawn(service: Service) -> None:
    """A model without a drawing has its numbers as a list, and its motion beside them."""
    page = service.http.get(f"/laboratory/{NAME}?damping=0.2", follow_redirects=True).text
    shown = Controls(page).values
    assert (shown["model"], shown["/base/damping"]) == (NAME, "0.2")
    assert 'class="picture"' not in page
    values = {**shown, "/base/body/mass": "500 g"}
    moved = service.http.post("/new/live", data=values).json()
    columns = {"body.mass": 0.5, "body.spring_rate": 1.0, "damping": 0.2}
    assert f'data-value="{displacement(columns, END)}"' in moved["answer"]
    assert "<svg" in moved["answer"]
    assert service.http.post("/new/live", data=values | {"/base/damping": "2"}).json()["answer"] == ""
    assert service.http.post("/new/along", data=values).json() == {"sparks": {}}
    assert 'data-cases="9"' in service.http.get(f"/new?model={NAME}&vary=damping&damping=0.2").text


def test_a_new_parameter_of_a_drive_is_in_the_form_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    drive, before = model_of(FORM_MODEL), names_by_title(FORM_MODEL)
    titles = ["Vibration of the base", "Pendulum 1", "Freewheel clutch", "Output shaft", "Surroundings"]
    assert list(before) == titles
    new = tuple(Parameter(p, "x", "1", 0.0, 9.0, False, 0.0, "new") for p in ("shaft.drag", "housing.mass", "pressure"))
    more = (*drive.parameters(), *new)
    monkeypatch.setattr(type(drive), "parameters", lambda _: more)
    after = names_by_title(FORM_MODEL)
    assert after == {
        **before,
        "Output shaft": [*before["Output shaft"], "/base/shaft/drag"],
        "Surroundings": [*before["Surroundings"], "/base/pressure"],
        "Housing": ["/base/housing/mass"],
    }
    spec, faults = spec_of({"/base/shaft/drag": "1", "/base/housing/mass": "2", "/base/pressure": "3"})
    base = spec["base"]
    assert (faults, base["shaft"]["drag"], base["housing"], base["pressure"]) == ({}, 1.0, {"mass": 2.0}, 3.0)


def test_rows_are_the_models(finished: tuple[Service, str]) -> None:
    service, study_id = finished
    study = service.store.studies.study(study_id)
    record = service.store.studies.get(study_id)
    assert (record.state, record.ok, record.variant) == ("finished", 12, "")
    block = service.store.rows.block(study_id)
    np.testing.assert_array_equal(block.values[:, 1], expected(study))
    row = service.get(f"/studies/{study_id}/cases/7")
    assert isinstance(row["results"]["swings"], int)


def test_curves_maps_sensitivity_and_trajectories(finished: tuple[Service, str]) -> None:
    service, study_id = finished
    values = expected(service.store.studies.study(study_id)).reshape(4, 3)
    curves = service.get(f"/studies/{study_id}/curves", x="body.spring_rate", y="displacement.end", by="body.mass")
    assert [curve["y"]["displacement.end"] for curve in curves["curves"]] == values.T.tolist()
    drawn = service.get(f"/studies/{study_id}/map", x="body.mass", y="body.spring_rate", z="displacement.end")
    assert drawn["z"]["values"] == values.tolist()
    shares = service.get(f"/studies/{study_id}/sensitivity", y="frequency")
    assert [effect["paths"] for effect in shares["results"][0]["effects"]] == [["body.spring_rate"], ["body.mass"]]
    motion = service.get(f"/studies/{study_id}/cases/0/trajectory", points=5)
    assert motion["values"]["displacement"][0] == 1.0
    assert motion["values"]["displacement"][-1] == values[0, 0]


@pytest.mark.parametrize("form", sorted(MEDIA_TYPES))
def test_every_export_has_its_rows(finished: tuple[Service, str], form: str) -> None:
    service, study_id = finished
    answer = service.http.get(f"/api/v1/studies/{study_id}/results", params={"format": form})
    assert answer.status_code == 200
    assert answer.content
    if form == "csv":
        rows = list(csv.DictReader(io.StringIO(answer.text)))
        values = expected(service.store.studies.study(study_id))
        assert [float(row["displacement.end"]) for row in rows] == values.tolist()


def test_pages_pictures_and_the_report_show_it(finished: tuple[Service, str]) -> None:
    service, study_id = finished
    own = f"/studies/{study_id}"
    pages = ("", "/rows", "/cases/7", "?z=swings")
    for page in (*(own + page for page in pages), "/", f"/compare?study={study_id}"):
        answer = service.http.get(page)
        assert answer.status_code == 200, page
        assert "a toy" in answer.text
    assert service.http.get(f"{own}/cases/7/motion.svg").status_code == 200
    columns = re.findall(r'name="show" value="([^"]+)" checked', service.http.get(f"{own}/rows").text)
    assert {"swings", "displacement.end", "body.mass"} <= set(columns)
    report = service.http.get(f"/api/v1{own}/report", params={"format": "html", "appendix": "all"})
    assert re.findall(rb"/Type/Pages/Count 2/", service.http.get(f"/api/v1{own}/report?format=pdf").content)
    assert "Displacement end" in report.text


def test_its_cases_are_reused(finished: tuple[Service, str]) -> None:
    service, _ = finished
    preview = service.http.post("/api/v1/studies:preview", json=SPEC | {"name": "again"}).json()
    assert (preview["cases"], preview["reusable"]) == (12, 12)


def test_commands_and_the_client_know_it(
    finished: tuple[Service, str], sprag: Callable[..., Any], portal: BlockingPortal, tmp_path: Path
) -> None:
    service, study_id = finished
    spec = tmp_path / "toy.json"
    spec.write_text(json.dumps(SPEC))
    assert sprag("check", spec).code == 0
    assert sprag("check", spec, "--json").data["cases"] == 12
    motion = sprag("show", spec, "trajectory", "--case", 7, "--points", 5)
    assert motion.code == 0
    assert motion.out.splitlines()[0].split(",")[1] == "displacement"
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps(SPEC | {"base": {"body": {"mass": 1, "spring_rate": -2}}}))
    assert "/base/body/spring_rate" in sprag("check", wrong, "--json").out
    values = expected(service.store.studies.study(study_id))
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        study = client.study(study_id)
        table = study.table()
        np.testing.assert_array_equal(table["displacement.end"], values)
        assert table.attrs["units"]["displacement.end"] == "m"
        drawn = study.curves("body.spring_rate", "displacement.end", by="body.mass").to_pandas()
        assert len(drawn) == 12


#: The mass follows from the spring; its values are those of some cases of `SPEC`.
DERIVED: dict[str, Any] = SPEC | {
    "name": "a derived toy",
    "base": {"body": {"spring_rate": 200}, "damping": 0.1},
    "derive": {"body.mass": "body.spring_rate / 200 N/m * 1 kg"},
    "axes": [{"path": "body.spring_rate", "linspace": [100, 400, 4]}, {"path": "damping", "values": [0.1, 0.2]}],
}


def test_derived_parameters_are_computed_and_their_rows_reused(finished: tuple[Service, str]) -> None:
    service, _ = finished
    preview = service.http.post("/api/v1/studies:preview", json=DERIVED).json()
    # Masses of 0.5, 1 and 2 kg were run with these springs and a damping of 0.1.
    assert (preview["cases"], preview["reusable"]) == (8, 3)
    assert preview["derive"] == {"body.mass": "body.spring_rate / 200.0 * 1.0"}
    study_id = service.submit(DERIVED)
    store = service.store
    Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study_id).state.terminal)
    rates, dampings = np.repeat([100.0, 200.0, 300.0, 400.0], 2), np.tile([0.1, 0.2], 4)
    by_hand = displacement({"body.spring_rate": rates, "body.mass": rates / 200.0, "damping": dampings}, END)
    np.testing.assert_array_equal(store.rows.block(study_id).values[:, 1], by_hand)
    motion = service.get(f"/studies/{study_id}/cases/7/trajectory", points=2)
    assert motion["values"]["displacement"][-1] == by_hand[7]
    # The other way: cases that were derived are those of a study that gives the same numbers.
    points = "body.spring_rate,body.mass,damping\n300,1.5,0.2\n300,1.6,0.2\n"
    plain = SPEC | {"axes": [{"points": points}]}
    assert service.http.post("/api/v1/studies:preview", json=plain).json()["reusable"] == 1
