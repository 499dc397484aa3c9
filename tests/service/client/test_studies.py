"""The Python client, synchronous and asynchronous, against the service: the same studies, the same numbers."""

from __future__ import annotations

import io
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import httpx
import numpy as np
import openpyxl
import pandas as pd
import pytest
from anyio.from_thread import BlockingPortal

from sprag_study.service.answers.studies import StudyDetail
from sprag_study.service.client import (
    AmbiguousError,
    ArgumentError,
    AsyncClient,
    AsyncStudy,
    Client,
    Curves,
    RefusedError,
    SpecFileError,
    StudyTimeoutError,
    UnreachableError,
)
from tests.faults import refused
from tests.service.conftest import PortalTransport, Service

if TYPE_CHECKING:
    from sprag_study.worker.models import ChunkResult

SPEED = "shaft.speed.mean"
ID = "st_0123456789abcdef"


@pytest.fixture
def client(service: Service, portal: BlockingPortal) -> Iterator[Client]:
    """A client of the service of the test."""
    with Client("http://localhost", transport=PortalTransport(service.app, portal)) as client:
        yield client


class Filling:
    """Fills a study with rows when it is told of it for the first time, as a dispatcher would meanwhile."""

    def __init__(self, service: Service) -> None:
        self.service = service
        self.states: list[str] = []
        self.rows: ChunkResult | None = None

    def __call__(self, study: StudyDetail, /) -> None:
        self.states.append(study["state"])
        if self.rows is None:
            self.rows = self.service.fill(study["id"])


def test_a_study_from_submission_to_table_grid_and_curves(
    client: Client, service: Service, spec: dict[str, Any], tmp_path: Path
) -> None:
    assert client.preview(spec)["cases"] == 9
    filling = Filling(service)
    study = client.submit(spec, key="one").wait(progress=filling)
    assert client.submit(spec, key="one").id == study.id
    assert filling.states[-1] == "finished"
    assert filling.rows is not None
    speeds = filling.rows.values[:, 0]

    table = study.table()
    assert list(table["case"]) == list(range(9))
    np.testing.assert_array_equal(table[SPEED], speeds)
    grid = study.grid()
    np.testing.assert_array_equal(grid[SPEED].values.reshape(-1), speeds)

    curves = study.curves("shaft.load", [SPEED, "torque.max"], by="excitation.frequency")
    frame = curves.to_pandas()
    assert list(frame.columns) == ["excitation.frequency", "shaft.load", SPEED, "torque.max", "ending", "case"]
    np.testing.assert_array_equal(frame[SPEED], speeds)
    assert frame.attrs["units"]["shaft.load"] == "N*m"
    labelled = curves.to_xarray()
    np.testing.assert_array_equal(labelled[SPEED].values.reshape(-1), speeds)
    assert labelled[SPEED].attrs["units"] == "rad/s"
    for name in ("ending", "case"):  # as in the file with all rows
        np.testing.assert_array_equal(labelled[name].values, grid[name].values)
        assert labelled[name].dtype == grid[name].dtype
    for name in ("flag_values", "flag_meanings"):
        assert list(labelled["ending"].attrs[name]) == list(grid["ending"].attrs[name])
    held = study.curves("shaft.load", SPEED, at={"excitation.frequency": np.float64(16.0)})
    np.testing.assert_array_equal(held.to_pandas()[SPEED], speeds[:3])
    assert study.curves("shaft.load", SPEED, at={"excitation.frequency": "960 rpm"}) == held

    assert study.map("shaft.load", "excitation.frequency", SPEED)["z"]["values"][0][0] == speeds[0]
    assert study.sensitivity(SPEED)["results"][0]["result"] == SPEED
    book = openpyxl.load_workbook(study.export(tmp_path / "rows.xlsx"))
    assert book.sheetnames == ["cases", "inputs"]
    assert study.export(tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
    assert len(pd.read_csv(io.BytesIO(study.download("csv")))) == 9
    assert study.picture(tmp_path / "curve.svg", "shaft.load", SPEED, by="excitation.frequency").stat().st_size > 1000
    english, ukrainian = (
        study.picture(
            tmp_path / f"{code}.svg", "shaft.load", SPEED, by="excitation.frequency", language=code
        ).read_text("utf-8")
        for code in ("en", "uk")
    )
    assert ("Load torque" in english, "Момент навантаження" in ukrainian) == (True, True)
    with pytest.raises(ValueError, match="cannot tell the format"):
        study.export(tmp_path / "rows.doc")
    with refused(RefusedError, "invalid-parameter", "invalid-choice"):
        study.export(tmp_path / "rows.xlsx", "doc")
    assert openpyxl.load_workbook(tmp_path / "rows.xlsx").sheetnames == ["cases", "inputs"]

    larger = study.extend([{"path": "shaft.load", "values": [0.5]}], name="larger")
    assert larger.detail()["cases"] == 12
    assert [item["id"] for item in client.studies()] == [larger.id, study.id]
    (queued,) = client.studies("queued")
    assert (queued["name"], queued.name, queued.state) == ("larger", "larger", "queued")
    assert (client.study(study.id).state, study.name) == ("finished", study["name"])
    assert repr(study) == f"Study({study.id!r}, {study.name!r}, 9 cases, finished)"
    assert repr(queued) == f"Study({larger.id!r}, 'larger', 12 cases)"
    assert larger.cancel()["state"] in ("cancelling", "cancelled")
    assert client.study(study.id).detail()["progress"]["endings"] == {"ok": 8, "chatter": 1}


def test_specs_come_from_files_too(client: Client, examples: Path) -> None:
    for name in ("one_pendulum.json", "two_pendulums.toml"):
        assert client.preview(examples / name)["cases"] > 50


@pytest.mark.parametrize(
    ("name", "content", "part"),
    [
        ("none.toml", None, "No such file"),
        ("bad.toml", b"a = = 1", "is not valid TOML"),
        ("bad.json", b"{", "is not valid JSON"),
        ("binary.json", b"\xff\xfe", "can't decode"),
    ],
)
def test_a_file_without_a_spec_is_named(
    client: Client, tmp_path: Path, name: str, content: bytes | None, part: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(SpecFileError, match=part) as caught:
        client.submit(tmp_path / name)
    assert name in str(caught.value)


def test_refusals_carry_the_fields_of_the_problem(client: Client, spec: dict[str, Any]) -> None:
    spec["base"]["shaft"]["inertia"] = "-2 kg*m^2"
    with pytest.raises(RefusedError) as caught:
        client.submit(spec)
    (error,) = caught.value.errors
    assert (error["pointer"], error["value"], error["unit"]) == ("/base/shaft/inertia", "-2 kg*m^2", "kg*m^2")
    assert error["allowed"] == "> 0 kg*m^2 and <= 1e+06 kg*m^2"
    assert caught.value.status == 422
    with refused(RefusedError, "study-not-found"):
        client.study("st_none")


def test_waiting_ends_after_its_time(client: Client, spec: dict[str, Any]) -> None:
    study = client.submit(spec)
    with refused(StudyTimeoutError, "not-done") as caught:
        study.wait(timeout=0.0)
    assert caught.value.study["id"] == study.id


def test_a_bar_is_shown_on_standard_error(
    client: Client, service: Service, spec: dict[str, Any], capsys: pytest.CaptureFixture[str]
) -> None:
    study = client.submit(spec)
    service.fill(study.id)
    study.wait(progress=True)
    assert capsys.readouterr().out == ""


def test_cases_side_by_side_with_equal_parameters_are_no_grid(client: Client, service: Service) -> None:
    point = {"by": {}, "at": {}, "x": [1.0, 1.0], "cases": [0, 1], "y": {SPEED: [1.0, None]}, "endings": ["ok", "x"]}
    data: Any = {
        "study": "st", "x": {"path": "shaft.load", "unit": "N*m", "values": [1.0, 1.0]}, "units": {"shaft.load": "N*m"},
        "results": {SPEED: {"unit": "rad/s", "description": ""}}, "curves": [point],
    }  # fmt: skip
    assert Curves(data).to_pandas()[SPEED].isna().tolist() == [False, True]
    with pytest.raises(ValueError, match="ending 'x' is unknown"):
        Curves(data).to_xarray()
    point["endings"] = ["ok", "pending"]
    with pytest.raises(ValueError, match="not form a grid"):
        Curves(data).to_xarray()


async def asynchronous(service: Service, spec: dict[str, Any], folder: Path) -> None:
    """The same with the other client."""
    filling = Filling(service)
    transport = httpx.ASGITransport(service.app)
    async with AsyncClient("http://localhost", transport=transport) as client:
        assert (await client.preview(spec))["cases"] == 9
        study = await (await client.submit(spec, key="one")).wait(progress=filling)
        assert filling.rows is not None
        speeds = filling.rows.values[:, 0]
        np.testing.assert_array_equal((await study.table())[SPEED], speeds)
        np.testing.assert_array_equal((await study.grid())[SPEED].values.reshape(-1), speeds)
        curves = await study.curves("shaft.load", SPEED, by="excitation.frequency")
        np.testing.assert_array_equal(curves.to_pandas()[SPEED], speeds)
        assert (await study.sensitivity(SPEED))["results"][0]["result"] == SPEED
        assert (await study.map("shaft.load", "excitation.frequency", SPEED))["z"]["values"][0][0] == speeds[0]
        held = await study.map("shaft.load", "excitation.frequency", SPEED, at={"excitation.amplitude_x": "2 mm"})
        assert held["z"]["values"][0][0] == speeds[0]
        assert len(pd.read_csv(await study.export(folder / "rows.csv"))) == 9
        assert (await study.export(folder / "rows.bin", "xlsx")).read_bytes().startswith(b"PK")
        picture = await study.picture(folder / "curve.png", "shaft.load", SPEED, by="excitation.frequency")
        assert picture.read_bytes().startswith(b"\x89PNG")
        with pytest.raises(ValueError, match="cannot tell the format"):
            await study.export(folder / "rows.doc")
        with refused(RefusedError, "invalid-parameter", "invalid-choice"):
            await study.picture(folder / "curve.gif", "shaft.load", SPEED)
        with refused(RefusedError, "invalid-parameter", "invalid-choice"):
            await study.export(folder / "none.csv", "doc")
        assert not (folder / "none.csv").exists()
        assert (await study.download("csv")).startswith(b"case,")
        larger = await study.extend(cases=[{"points": "shaft.load\n0.9\n"}])
        assert (await larger.detail())["cases"] == 10
        listed = [item async for item in client.studies()]
        assert [item.id for item in listed] == [larger.id, study.id]
        assert [item.state for item in listed] == ["queued", "finished"]
        assert (await larger.cancel())["id"] == larger.id
        with pytest.raises(StudyTimeoutError):
            await (await client.submit(spec, fresh=True)).wait(timeout=0.0)
        with refused(RefusedError, "invalid-parameter", "invalid-choice"):
            await study.download("doc")
        with refused(RefusedError, "study-not-found"):
            await client.study("st_none")
    async with AsyncClient("http://127.0.0.1:9") as nobody:
        with pytest.raises(UnreachableError):
            await nobody.preview(spec)
        with pytest.raises(UnreachableError):
            await nobody.read("/studies", [])
        with pytest.raises(UnreachableError):
            await AsyncStudy(nobody, "st_1").export(folder / "none.csv")
        assert not (folder / "none.csv").exists()


def test_the_asynchronous_client_does_the_same(
    service: Service, portal: BlockingPortal, spec: dict[str, Any], tmp_path: Path
) -> None:
    portal.call(partial(asynchronous, service, spec, tmp_path))


@pytest.mark.parametrize("value", [float("nan"), np.float64("inf")])
def test_a_number_that_is_none_is_refused_with_its_path(
    client: Client, service: Service, portal: BlockingPortal, spec: dict[str, Any], value: float
) -> None:
    wrong = {**spec, "axes": ({"path": "shaft.load", "values": (0.1, value)},)}
    with refused(RefusedError, "invalid-spec", "not-finite") as caught:
        client.submit(wrong)
    assert caught.value.status == 422
    assert [(fault["pointer"], fault["value"]) for fault in caught.value.errors] == [("/axes/0/values/1", str(value))]

    async def asynchronous_one() -> None:
        async with AsyncClient("http://localhost", transport=httpx.ASGITransport(service.app)) as other:
            with refused(RefusedError, "invalid-spec", "not-finite"):
                await other.preview(wrong)

    portal.call(asynchronous_one)


def test_server_and_token_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SPRAG_SERVER", "http://127.0.0.1:9/")
    monkeypatch.setenv("SPRAG_TOKEN", "secret")
    seen: list[httpx.Request] = []

    def answer(request: httpx.Request) -> httpx.Response:
        seen.append(request)
        return httpx.Response(200, json={"id": ID})

    with Client(transport=httpx.MockTransport(answer)) as client:
        assert repr(client.study(ID)) == f"Study('{ID}')"
    assert seen[0].headers["authorization"] == "Bearer secret"
    assert seen[0].url == f"http://127.0.0.1:9/api/v1/studies/{ID}"


def test_studies_are_named_as_on_the_command_line(client: Client, service: Service, spec: dict[str, Any]) -> None:
    first, second = (service.submit({**spec, "name": name}) for name in ("feeder, slow", "feeder, fast"))
    assert client.study("latest").id == second
    assert client.study("feeder, s").id == first
    assert client.study(first[:-2] if first[:-2] != second[:-2] else first).id == first
    with pytest.raises(AmbiguousError, match="fits several studies") as caught:
        client.study("feeder")
    assert (caught.value.code, caught.value.faults[0].code) == ("invalid-parameter", "ambiguous")
    with refused(RefusedError, "study-not-found"):
        client.study("nothing")
    for ask, argument in (
        (client.study, "study_id"),
        (client.schedule, "schedule_id"),
        (client.model, "name"),
        (client.delete_component, "component_id"),
    ):
        for wrong in (None, 7, "", " "):
            with pytest.raises(ArgumentError, match=f"^{argument}: is not possible .*allowed: an id or name"):
                ask(wrong)  # type: ignore[operator]
    for study in (first, second):
        service.fill(study)
    at = {"excitation.frequency": "16 Hz"}
    assert client.compare(["feeder, slow", "latest"], "shaft.load", SPEED, at=at).names == (
        "feeder, slow",
        "feeder, fast",
    )


def test_cases_are_numbered_from_0(client: Client, service: Service) -> None:
    study = client.study(service.submit())
    for wrong in (-1, "abc", 1.5, True, None):
        with pytest.raises(ArgumentError, match=r"^case: is not possible .*allowed: whole numbers from 0") as caught:
            study.case(wrong)  # type: ignore[arg-type]
        assert (caught.value.code, caught.value.faults[0].where) == ("invalid-parameter", "case")
    assert study.case(np.int64(0)) == study.case(0)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="got -3"):
        study.trajectory(-3)
