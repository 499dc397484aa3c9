"""A study that was run here answers as the same study of a service does: every method, file and refusal."""

from __future__ import annotations

import io
import json
import pickle
import re
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from anyio.from_thread import BlockingPortal

import sprag_study as sprag
from sprag_study.service.client import Client, RefusedError, Study
from sprag_study.service.client.sketch import Picture
from sprag_study.service.settings import Settings
from tests.service.calibrating import calibration
from tests.service.client.conftest import OfService
from tests.service.conftest import PortalTransport, Service
from tests.service.searching import search

LOAD, SPEED, FREQUENCY = "shaft.load", "shaft.speed.mean", "excitation.frequency"


#: What one asks of a study.
ASKED: dict[str, Callable[[Study], Any]] = {
    "detail": lambda study: study.detail(),
    "curves": lambda study: study.curves(LOAD, [SPEED, "efficiency"], by=FREQUENCY),
    "usual curves": lambda study: study.curves(),
    "map": lambda study: study.map(LOAD, FREQUENCY, SPEED),
    "answers": lambda study: study.answers("0.1 N*m"),
    "explore": lambda study: study.explore("shaft.load <= 2 N*m", sort="-efficiency", limit=3),
    "sensitivity": lambda study: study.sensitivity(SPEED),
    "rounds": lambda study: study.rounds(),
    "case": lambda study: study.case(3),
    "regimes": lambda study: study.regimes(3),
    "cases": lambda study: list(study.cases(ending="ok", sort=f"-{LOAD}")),
    "table": lambda study: study.table("rpm").to_json(),
    "side by side": lambda study: study.side_by_side([1, 2]).to_json(),
    "grid": lambda study: study.grid().to_dict(),
    "csv": lambda study: study.download("csv", header="units"),
    "report": lambda study: study.download("html", language="uk"),
    "trajectory": lambda study: study.trajectory(3, "2 periods", "3 periods", points=5),
    "transient of a drive": lambda study: study.transient(3, "run-up"),
    "wrong points": lambda study: study.trajectory(3, points=1),
    "no such axis": lambda study: study.curves("nonsense"),
    "no such case": lambda study: study.case(99),
    "no such start": lambda study: study.strobes(1, start=5),
    "no tolerances": lambda study: study.ribbon(),
    "no conditions": lambda study: study.yields([]),
    "no calibration": lambda study: study.calibration(),
    "no goal": lambda study: study.front(),
    "repr of curves": lambda study: repr(study.curves(LOAD, [SPEED, "efficiency"], by=FREQUENCY)),
    "too many rows": lambda study: study.explore(limit=10**6),
    "not a number": lambda study: study.explore(limit="many"),  # type: ignore[arg-type]
    "no such language": lambda study: study.download("pdf", language="xx"),
    "no such format": lambda study: study.download("docx"),
    "no such units": lambda study: study.table("bogus"),
    "nothing to narrow": lambda study: study.narrow(),
}


@pytest.mark.parametrize("name", ASKED)
def test_the_answer_is_that_of_a_service(pair: tuple[Study, Study], name: str) -> None:
    there, here = (_answer(ASKED[name], study) for study in pair)
    assert here == there


def _answer(ask: Callable[[Study], Any], study: Study) -> Any:
    """The answer as it can be compared, or how it was refused."""
    try:
        answer = ask(study)
    except RefusedError as error:
        return error.status, error.code, error.faults
    return json.loads(json.dumps(answer.data if is_dataclass(answer) else answer, default=str))


@pytest.mark.parametrize("kind", ["goal", "calibration", "tolerances"])
def test_so_is_that_of_a_study_of_another_kind(
    service: Service, portal: BlockingPortal, settings: Settings, spec: dict[str, Any], kind: str
) -> None:
    if kind == "tolerances":
        study_id = service.submit({**spec, "tolerances": [{"path": "shaft.inertia", "plus_minus": "5 %"}], "drives": 8})
        service.fill(study_id)
    else:
        study_id = search(service) if kind == "goal" else calibration(service)
    client = Client("http://localhost", transport=PortalTransport(service.app, portal))
    asked: dict[str, list[Callable[[Study], Any]]] = {
        "goal": [lambda study: study.front(5, exact=True), lambda study: study.rounds()],
        "calibration": [lambda study: study.calibration(), lambda study: study.rounds()],
        "tolerances": [
            lambda study: study.ribbon(LOAD, SPEED, quantiles=(0.1, 0.9), at={FREQUENCY: "20 Hz"}),
            lambda study: study.yields(f"{SPEED} >= 90 % of nominal", LOAD, worst=2),
            lambda study: repr(study.ribbon(LOAD, SPEED, at={FREQUENCY: "20 Hz"})),
        ],
    }
    for ask in asked[kind]:
        there, here = (
            _answer(ask, Study(client, study_id)), _answer(ask, Study(OfService(service.store, settings), study_id))
        )  # fmt: skip
        assert here == there


@pytest.mark.parametrize(
    "ask",
    [
        lambda study: study.picture("never.svg", view="nonsense"),
        lambda study: study.picture("never.svg", view="nonsense", case=0),
        lambda study: study.narrow(steps=1.5),
        lambda study: study.run_longer(at_most=7),
        lambda study: study.trajectory(1, start="x"),
        lambda study: study.extend([{"path": LOAD, "values": [object()]}]),
    ],
)
def test_what_a_service_refuses_is_refused_here(pair: tuple[Study, Study], ask: Callable[[Study], Any]) -> None:
    refusals = []
    for study in pair:
        with pytest.raises(RefusedError) as refused:
            ask(study)
        refusals.append((refused.value.status, refused.value.code))
    assert refusals[0] == refusals[1]


def _unnumbered(spec: dict[str, Any]) -> dict[str, Any]:
    """A spec without the number that tells its name from those of other studies of its database."""
    return {**spec, "name": re.sub(r" \d+$", "", spec["name"])}


def test_values_of_numpy_are_taken_as_a_service_takes_them(pair: tuple[Study, Study]) -> None:
    there, here = (study.extend([{"path": LOAD, "values": np.array([3.0, 4.0])}]).detail() for study in pair)
    assert (_unnumbered(there["spec"]), there["cases"]) == (_unnumbered(here["spec"]), here["cases"])


def test_pictures_are_those_of_a_service(pair: tuple[Study, Study], tmp_path: Path) -> None:
    there, here = (
        study.picture(tmp_path / f"{place}.svg", LOAD, SPEED, by=FREQUENCY, units="rpm", language="uk").read_bytes()
        for place, study in enumerate(pair)
    )
    assert here == there


def test_further_studies_are_made_as_a_service_makes_them(pair: tuple[Study, Study]) -> None:
    for further in (
        lambda study: study.select("shaft.load <= 2 N*m", limit=2),
        lambda study: study.extend([{"path": LOAD, "values": ["3 N*m"]}]),
    ):
        there, here = (further(study).detail() for study in pair)
        assert (_unnumbered(there["spec"]), there["cases"]) == (_unnumbered(here["spec"]), here["cases"])
    with pytest.raises(RefusedError) as refused:
        pair[1].pause()
    assert (refused.value.status, refused.value.code) == (405, "method-not-allowed")


@pytest.fixture(scope="module")
def run() -> sprag.Study:
    """A small study, run here."""
    return sprag.run(_small(), processes=0)


def _small() -> dict[str, Any]:
    spec = sprag.preset("one_pendulum")
    spec["axes"] = [{"path": LOAD, "values": ["0 N*m", "0.1 N*m", "0.2 N*m"]}]
    spec["run"] = {"duration": "12 periods", "window": ["8 periods", "12 periods"]}
    return spec


def test_a_study_run_here_is_a_study(run: sprag.Study, tmp_path: Path) -> None:
    assert isinstance(run, sprag.Study)
    assert run.wait() is run
    assert [event.kind for event in run.events()] == ["end"]
    assert run.curves(LOAD, SPEED).to_pandas()[SPEED].tolist() == run.table()[SPEED].tolist()
    assert run.trajectory(1, points=20).to_pandas().shape[0] == 20
    assert run.export(tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
    assert repr(run) == f"Study({_small()['name']!r}: 3 cases, 3 ok)"
    assert "<svg" in run._repr_html_()  # type: ignore[operator]
    more = run.extend([{"path": LOAD, "values": ["0.3 N*m"]}])
    assert more.table()[LOAD].tolist() == [0.0, 0.1, 0.2, 0.3]


def test_it_is_its_own_table(run: Any) -> None:
    table = run.table()
    assert list(run) == list(table.columns)
    assert len(run) == 3
    assert LOAD in run
    assert run.attrs["units"][SPEED] == "rad/s"
    assert run.attrs["warnings"] == []
    pd.testing.assert_frame_equal(run.loc[:, [LOAD, SPEED]], table[[LOAD, SPEED]])
    np.testing.assert_array_equal(np.asarray(run[SPEED]), table[SPEED])
    run["double"] = 2 * run[SPEED]
    assert run["double"].tolist() == (2 * table[SPEED]).tolist()
    assert "double" not in run.table()
    text = io.StringIO()
    run[[LOAD]].to_csv(text)
    assert text.getvalue().startswith(",shaft.load")
    assert np.asarray(run).shape == (3, len(run.columns))
    with pytest.raises(AttributeError, match="neither a study nor its table has 'nothing'"):
        run.nothing  # noqa: B018


def test_what_a_study_gives_is_printed_in_short(run: sprag.Study) -> None:
    assert repr(run.curves(LOAD, SPEED)) == f"Curves({LOAD}, {SPEED})"
    assert repr(run.trajectory(1, points=20)).startswith("Motion(times, ")
    assert repr(run.trajectory(1, points=20)).endswith(" more columns)")
    assert repr(run.engagements(1)) == f"Engagements(case 1: {len(run.engagements(1).to_pandas())} engagements)"
    picture = run.plot(LOAD, SPEED)
    assert picture._repr_svg_().lstrip().startswith(("<?xml", "<svg"))
    assert repr(picture) == f"Picture(SVG, {len(picture.svg):,} bytes)"
    png = Picture(b"\x89PNG", "png")
    with pytest.raises(AttributeError, match="the picture is a PNG: its bytes are `content`"):
        _ = png.svg


def test_any_view_can_be_a_picture(run: sprag.Study, tmp_path: Path) -> None:
    assert b"<svg" in run.plot(LOAD, SPEED, view="curves", units="rpm", language="uk").svg
    assert run.picture(tmp_path / "a.png", view="strobes", case=1).read_bytes().startswith(b"\x89PNG")
    plotted = run.plot(view="strobes", case=1, file=tmp_path / "b.png")
    assert plotted.content == (tmp_path / "b.png").read_bytes() == (tmp_path / "a.png").read_bytes()
    assert (plotted._repr_png_(), plotted._repr_svg_()) == (plotted.content, None)
    with pytest.raises(ValueError, match="as `file` of `plot`"):
        run.plot(LOAD, SPEED).save(tmp_path / "c.png")
    assert not (tmp_path / "c.png").exists()
    run.plot(LOAD, SPEED).save(tmp_path / "c.svg")
    with pytest.raises(RefusedError):
        run.plot(view="front")


def test_a_study_and_what_it_gives_can_be_pickled(run: sprag.Study) -> None:
    again = pickle.loads(pickle.dumps(run))
    curves = run.curves(LOAD, SPEED)
    assert again.curves(LOAD, SPEED) == pickle.loads(pickle.dumps(curves)) == curves
    assert repr(again) == repr(run)


def test_a_temporary_database_is_deleted_with_its_study() -> None:
    program = f"""
import glob, tempfile, sprag_study as sprag
study = sprag.run({_small()!r}, processes=0)
(folder,) = glob.glob(tempfile.gettempdir() + "/sprag-run-*")
with sprag.run({_small()!r}, processes=0) as other: pass
print(glob.glob(tempfile.gettempdir() + "/sprag-run-*") == [folder])
del study
print(glob.glob(tempfile.gettempdir() + "/sprag-run-*"))
left = sprag.run({_small()!r}, processes=0)
"""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", program],
            env={"TMPDIR": folder, "PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        assert (done.stdout, done.stderr) == ("True\n[]\n", "")
        assert not list(Path(folder).glob("sprag-*"))


def test_a_preset_is_named_and_a_file_of_that_name_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from sprag_study.service.client.queries import spec_of

    assert spec_of("one_pendulum") == sprag.preset("one_pendulum")
    monkeypatch.chdir(tmp_path)
    Path("one_pendulum").write_text('{"sprag": 1}')
    assert spec_of("one_pendulum") == {"sprag": 1}
    with pytest.raises(sprag.SpecFileError, match="two_pendulums"):
        sprag.preset("two_pendulum")
    with pytest.raises(sprag.SpecFileError, match="a study that comes with Sprag is called 'two_pendulums'"):
        sprag.Drive.of("two_pendulum")


def test_studies_are_compared_wherever_they_were_run(run: sprag.Study, pair: tuple[Study, Study]) -> None:
    other = _small()
    other["base"]["shaft"]["inertia"] = "4e-3 kg*m^2"
    with sprag.run(other, processes=0) as changed:
        comparison = sprag.compare([run, changed], y=SPEED)
    assert list(comparison.inputs) == ["/base/shaft/inertia"]
    assert comparison.curves[0] == run.curves(LOAD, SPEED, rest="usual")
    assert sprag.compare([*pair]).curves[0] == sprag.compare([*pair]).curves[1]
    with pytest.raises(ValueError, match="2 to 10"):
        sprag.compare([run])


def test_what_is_closed_says_so() -> None:
    with sprag.run(_small(), processes=0) as study:
        assert len(study.table()) == 3
    assert repr(study) == f"Study({study.id!r}, closed)"
    with pytest.raises(sprag.StoreError, match="the study is closed"):
        study.curves()


def test_axes_are_a_table_too(run: sprag.Study) -> None:
    frame = pd.DataFrame({LOAD: [0.0, 0.1, 0.2], FREQUENCY: [25.0, 25.0, 25.0]})
    table = sprag.run({**_small(), "axes": frame}, processes=0)
    assert table[FREQUENCY].tolist() == [25.0] * 3
    np.testing.assert_allclose(table[SPEED], run.table()[SPEED], rtol=1e-9)


def test_a_thread_gets_the_view_that_it_asks_for(
    service: Service, settings: Settings, spec: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    study_id = service.submit(spec)
    service.fill(study_id)
    kept: list[Any] = []  # the first view stands for that of another thread, which is kept at the same moment
    latest = property(lambda _here: kept[0] if kept else None, lambda _here, pair: kept.append(pair) if pair else None)
    monkeypatch.setattr(OfService, "_latest", latest, raising=False)
    here = OfService(service.store, settings)
    for name in ("explore", "answers"):
        found = here.request("GET", f"/studies/{study_id}/{name}")
        assert found == service.get(f"/studies/{study_id}/{name}")
    assert len(kept) == 2
