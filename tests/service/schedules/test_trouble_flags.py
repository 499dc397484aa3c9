"""Which flags of cases need attention is up to the schedule: through the API, the form and the command."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service import languages
from sprag_study.service.http.views import preset_of
from sprag_study.service.jobs.reports.message import sentence
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.jobs.submission import accept
from sprag_study.service.schedules.fields import change_fields, read_fields
from sprag_study.service.schedules.outcomes import Outcome, Result
from sprag_study.service.schedules.trouble import usual_flags
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.worker import models
from tests.service.conftest import made_up
from tests.service.schedule_command import Run, runner
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock

API = "/api/v1/schedules"
NIGHTLY = {"spec": SPEC, "cron": "0 1 * * *", "name": "nightly"}
FORM = {"source": "preset one_pendulum", "when": "cron", "cron": "0 1 * * *", "zone": "UTC", "trouble_flags": ""}
SHAFT = {
    "sprag": 1,
    "model": "machine-shaft",
    "base": preset_of("punching_press")["spec"]["base"],
}


@pytest.fixture
def all_have(monkeypatch: pytest.MonkeyPatch) -> Callable[[str], None]:
    """Every case that is filled in ends ok with these flags."""

    def choose(flags: str) -> None:
        def made(study: Study) -> ChunkResult:
            return replace(made_up(study), endings=["ok"] * study.cases, flags=[flags] * study.cases)

        monkeypatch.setattr("tests.service.conftest.made_up", made)

    return choose


@pytest.fixture
def run(service: Service, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    return runner(service, monkeypatch, capsys)


def one_night(service: Service, clock: Clock) -> dict[str, Any]:
    """The outcome of the only run of the night, which is finished."""
    clock.set("2026-01-01T01:00")
    Scheduler(service.store).look()
    (study,) = service.store.studies.page().studies
    service.fill(study.id)
    before = service.get("/night")["runs"][0]["outcome"]
    Scheduler(service.store).look()
    (run,) = service.get("/night")["runs"]
    assert run["outcome"] == before | {"ended_at": run["outcome"]["ended_at"]}, "counted at once, and kept"
    return dict(run["outcome"])


@pytest.mark.parametrize(
    ("flags", "chosen", "counted", "end"),
    [
        ("unsettled", {}, ["not_settled", "unsettled"], "The motions of 9 cases are unsettled."),
        ("not_settled", {}, ["not_settled", "unsettled"], "Flag not settled: 9 cases."),
        ("unsettled", {"trouble_flags": None}, ["not_settled", "unsettled"], "The motions of 9 cases are unsettled."),
        ("unsettled", {"trouble_flags": []}, [], ""),
        ("not_settled", {"trouble_flags": []}, [], ""),
        ("jumped", {}, ["not_settled", "unsettled"], ""),
        ("unsettled", {"trouble_flags": ["jumped"]}, ["jumped"], ""),
        ("jumped,unsettled", {"trouble_flags": ["jumped"]}, ["jumped"], "Flag jumped: 9 cases."),
        ("irregular", {"trouble_flags": ["irregular"]}, ["irregular"], "Flag irregular: 9 cases."),
        (
            "jumped,unsettled",
            {"trouble_flags": ["unsettled", "jumped"]},
            ["unsettled", "jumped"],
            "The motions of 9 cases are unsettled. Flag jumped: 9 cases.",
        ),
    ],
)
def test_a_night_is_judged_by_the_flags_of_its_schedule(
    service: Service,
    clock: Clock,
    all_have: Callable[[str], None],
    flags: str,
    chosen: dict[str, Any],
    counted: list[str],
    end: str,
) -> None:
    made = service.http.post(API, json={**NIGHTLY, **chosen})
    assert made.status_code == 201, made.text
    assert made.json()["trouble_flags"] == chosen.get("trouble_flags")
    all_have(flags)
    outcome = one_night(service, clock)
    assert (outcome["trouble"], outcome["trouble_flags"]) == (bool(end), counted)
    # Unsettled motions are shown, whether they count or not; irregular motion is as good as periodic motion.
    assert outcome["flags"] == dict.fromkeys(flags.split(","), 9)
    ended = "9 of 9 cases are done, and 9 of them ended ok. " + end if end else "all 9 cases ended ok."
    assert outcome["sentence"] == f"Finished: {ended}"
    assert service.get("/night")["trouble"] == bool(end)
    assert ("needs attention" if end else "The only run went as planned") in service.http.get("/nights").text
    assert service.get("/schedules")["schedules"][0]["last_run"]["outcome"] == outcome


def test_irregular_motion_is_no_flag_of_a_night_that_does_not_name_it(
    service: Service, clock: Clock, all_have: Callable[[str], None]
) -> None:
    service.http.post(API, json=NIGHTLY)
    all_have("irregular")
    outcome = one_night(service, clock)
    assert (outcome["trouble"], outcome["flags"]) == (False, {})


def test_a_change_holds_for_runs_that_end_after_it(
    service: Service, clock: Clock, all_have: Callable[[str], None]
) -> None:
    made = service.http.post(API, json=NIGHTLY).headers["location"]
    all_have("unsettled")
    first = one_night(service, clock)
    assert first["trouble"]
    assert service.http.patch(made, json={"trouble_flags": []}).json()["trouble_flags"] == []
    assert service.get("/night")["runs"][0]["outcome"] == first, "what was told stays"
    clock.set("2026-01-02T01:00")
    Scheduler(service.store).look()
    service.fill(service.store.studies.page().studies[0].id)
    Scheduler(service.store).look()
    latest, earlier = service.http.get(made).json()["runs"]
    assert (latest["outcome"]["trouble"], earlier["outcome"]["trouble"]) == (False, True)
    assert service.http.patch(made, json={"priority": 2}).json()["trouble_flags"] == []
    assert service.http.patch(made, json={"trouble_flags": None}).json()["trouble_flags"] is None


def test_reports_say_which_flag_it_is(service: Service, clock: Clock, all_have: Callable[[str], None]) -> None:
    """Only on trouble, and in the language of mails."""
    to = {"report_email": ["dora@example.com"], "report_when": "trouble"}
    service.store.schedules.create(read_fields({**NIGHTLY, **to, "trouble_flags": ["jumped"]}, NEW_YEAR))
    service.store.schedules.create(read_fields({**NIGHTLY, **to, "trouble_flags": []}, NEW_YEAR))
    all_have("jumped,unsettled")
    clock.set("2026-01-01T01:00")
    Scheduler(service.store).look()
    for study in service.store.studies.page().studies:
        service.fill(study.id)
    Scheduler(service.store).look()
    report = service.store.reports.claim()
    assert report is not None
    assert service.store.reports.claim() is None
    assert sentence(report.content).endswith("ended ok. Flag jumped: 9 cases.")
    with languages.language("uk"):
        assert sentence(report.content).endswith("Позначка «стрибок»: 9 випадків.")


def test_outcomes_of_before_keep_their_judgement() -> None:
    """They do not say which flags counted: `unsettled` did."""
    kept = Outcome(Result.FINISHED, "st_1", "n", 9, 9, 9, {}, {"unsettled": 2, "jumped": 1}).to_json()
    del kept["trouble_flags"]
    assert (Outcome.of_json(kept).trouble_flags, Outcome.of_json(kept).trouble) == (("unsettled",), True)
    assert Outcome.of_json({**kept, "flags": {"jumped": 1}}).trouble is False
    assert Outcome.of_json({**kept, "flags": None}).trouble_flags is None


def test_the_usual_flags_are_those_of_missing_values() -> None:
    assert usual_flags(models.VIBRATION_DRIVE) == ("not_settled", "unsettled")
    assert usual_flags(models.MACHINE_SHAFT) == ()
    for name in models.model_names():
        assert set(usual_flags(name)) == models.model_of(name).unsettled


@pytest.mark.parametrize(
    ("flags", "where", "code"),
    [
        ("unsettled", "", "wrong-type"),
        ({}, "", "wrong-type"),
        ([1], "/0", "wrong-type"),
        ([["jumped"]], "/0", "wrong-type"),
        (["jumped", "unsetled"], "/1", "unknown-name"),
        (["default"], "/0", "unknown-name"),
        (["ok"], "/0", "unknown-name"),
        ([""], "/0", "unknown-name"),
        (["jumped", "unsettled", "jumped"], "/2", "repeated"),
    ],
)
def test_flags_that_the_model_has_not_are_refused(service: Service, flags: Any, where: str, code: str) -> None:
    answer = service.http.post(API, json={**NIGHTLY, "trouble_flags": flags})
    (fault,) = answer.json()["errors"]
    assert (answer.status_code, fault["pointer"], fault["code"]) == (422, f"/trouble_flags{where}", code)
    for name in models.flags_of(models.VIBRATION_DRIVE):
        assert name in fault["allowed"]
    made = service.http.post(API, json=NIGHTLY).headers["location"]
    assert service.http.patch(made, json={"trouble_flags": flags}).status_code == 422
    assert service.http.get(made).json()["trouble_flags"] is None


def test_a_near_name_is_offered_and_very_long_lists_are_bounded() -> None:
    with pytest.raises(SpecError, match="did you mean 'unsettled'") as error:
        read_fields({**NIGHTLY, "trouble_flags": ["unsetled"]}, NEW_YEAR)
    assert "is not a flag of the model vibration-drive" in str(error.value)
    with pytest.raises(SpecError) as error:
        read_fields({**NIGHTLY, "trouble_flags": ["x"] * 200_000}, NEW_YEAR)
    assert len(error.value.faults) < 1000


def test_a_model_without_flags_takes_an_empty_list_only() -> None:
    shaft = {**NIGHTLY, "spec": SHAFT}
    assert read_fields(shaft, NEW_YEAR).trouble_flags is None
    assert read_fields({**shaft, "trouble_flags": []}, NEW_YEAR).trouble_flags == ()
    with pytest.raises(SpecError, match="machine-shaft, which has none"):
        read_fields({**shaft, "trouble_flags": ["unsettled"]}, NEW_YEAR)
    drive = read_fields(NIGHTLY, NEW_YEAR)
    assert change_fields(drive, {"spec": SHAFT}, NEW_YEAR).trouble_flags is None
    named = read_fields({**NIGHTLY, "trouble_flags": ["unsettled"]}, NEW_YEAR)
    with pytest.raises(SpecError, match="/trouble_flags/0"):
        change_fields(named, {"spec": SHAFT}, NEW_YEAR)
    assert change_fields(named, {"spec": SHAFT, "trouble_flags": None}, NEW_YEAR).trouble_flags is None


def test_faults_of_the_spec_and_of_the_flags_come_together() -> None:
    with pytest.raises(SpecError) as error:
        read_fields({**NIGHTLY, "spec": {**SPEC, "model": "x"}, "trouble_flags": "y"}, NEW_YEAR)
    assert {fault.where for fault in error.value.faults} == {"/spec/model", "/trouble_flags"}


def ticked(page: str) -> set[str]:
    return set(re.findall(r'name="trouble_flags/(\w+)" checked', page))


def test_the_form_has_a_box_for_each_flag(service: Service) -> None:
    empty = service.http.get("/nights/new").text
    assert set(re.findall(r'name="trouble_flags/(\w+)"', empty)) == set(models.flags_of(models.VIBRATION_DRIVE))
    assert ticked(empty) == {"not_settled", "unsettled"}
    usual = {"trouble_flags/unsettled": "on", "trouble_flags/not_settled": "on"}
    for boxes, kept, shown in (
        (usual, None, {"not_settled", "unsettled"}),
        ({}, (), set()),
        ({"trouble_flags/jumped": "on"}, ("jumped",), {"jumped"}),
        ({"trouble_flags/unsettled": "on"}, ("unsettled",), {"unsettled"}),
    ):
        assert service.http.post("/nights/new", data={**FORM, **boxes}).status_code == 303
        record = service.store.schedules.all()[0]
        assert record.fields.trouble_flags == kept
        page = f"/nights/{record.id}"
        assert ticked(service.http.get(page).text) == shown
        # Saved again as it is shown, with "the current one" for the study.
        again = {**FORM, "source": "", **{f"trouble_flags/{name}": "on" for name in shown}}
        assert service.http.post(page, data=again).status_code == 303
        assert service.store.schedules.get(record.id).fields.trouble_flags == kept
    without = {name: text for name, text in FORM.items() if name != "trouble_flags"}
    assert service.http.post(page, data={**without, "source": ""}).status_code == 303
    assert service.store.schedules.get(record.id).fields.trouble_flags == ("unsettled",), "a form of before keeps it"


def test_the_form_says_what_is_wrong_in_the_language_of_the_page(service: Service) -> None:
    shaft = {**FORM, "source": "preset compressor", "trouble_flags/jumped": "on"}
    for language, texts in (
        ("en", ("is not a flag of the model machine-shaft, which has none; allowed: no flag", "What needs attention")),
        ("uk", ("; дозволено: жодної позначки<", "Що потребує уваги", "Стрибок")),
    ):
        answer = service.http.post(f"/nights/new?language={language}", data=shaft)
        assert answer.status_code == 422
        fault = re.search(r'id="wrong-trouble_flags" role="alert">([^<]*)<', answer.text)
        assert fault, "beside the boxes"
        for text in texts:
            assert text in answer.text
        assert ticked(answer.text) == {"jumped"}
    usual = {**shaft, "trouble_flags/unsettled": "on", "trouble_flags/not_settled": "on"}
    del usual["trouble_flags/jumped"]
    assert service.http.post("/nights/new", data=usual).status_code == 303, "the usual ones fit every model"


def test_the_form_of_a_study_has_the_flags_of_its_model(service: Service) -> None:
    shaft, drive = (accept(service.store, parse_spec(spec)).id for spec in (SHAFT, SPEC))
    page = service.http.get(f"/nights/new?study={shaft}").text
    assert "trouble_flags" not in page
    assert "What needs attention" not in page
    assert (
        service.http.post(
            "/nights/new", data={"source": f"study {shaft}", "when": "cron", "cron": "@daily", "zone": "UTC"}
        ).status_code
        == 303
    )
    assert "trouble_flags" not in service.http.get(f"/nights/{service.store.schedules.all()[0].id}").text
    assert "trouble_flags/jumped" in service.http.get(f"/nights/new?study={drive}").text
    assert '<p class="soft">Vibration drive</p>' in service.http.get("/nights/new").text, "before one is chosen"


def test_the_example_of_a_cron_expression_keeps_its_asterisks(service: Service) -> None:
    answer = service.http.post("/nights/new", data={**FORM, "cron": "never"})
    assert 'allowed: five fields, such as "0 22 * * 1-5"' in html.unescape(answer.text)


def test_the_command_names_flags(run: Run, service: Service, tmp_path: Path) -> None:
    file = tmp_path / "spec.json"
    file.write_text(json.dumps(SPEC))
    add = ("add", str(file), "--cron", "@daily", "--name", "odd")
    code, out, err = run(*add, "--trouble-flag", "jumped", "--trouble-flag", "unsettled")
    assert code == 0, err
    name = out.strip()
    for arguments, kept in (
        ((), ["jumped", "unsettled"]),
        (("--trouble-flag", ""), []),
        (("--priority", "3"), []),
        (("--trouble-flag", "default"), None),
        (("--trouble-flag", "restarted"), ["restarted"]),
    ):
        assert not arguments or run("change", name, *arguments)[0] == 0
        assert service.get(f"/schedules/{name}")["trouble_flags"] == kept
    for wrong in (("default", "jumped"), ("unsetled",)):
        options = [text for flag in wrong for text in ("--trouble-flag", flag)]
        code, _, err = run("change", name, *options, "--json")
        (problem,) = json.loads(err)["problems"]
        assert (code, problem["pointer"], problem["code"]) == (2, "/trouble_flags/0", "unknown-name")
    assert service.get(f"/schedules/{run(*add)[1].strip()}")["trouble_flags"] is None


def test_a_night_of_unsettled_cases_ends_the_command_as_its_schedule_says(
    run: Run, service: Service, clock: Clock, all_have: Callable[[str], None]
) -> None:
    made = service.http.post(API, json={**NIGHTLY, "trouble_flags": []})
    all_have("unsettled")
    one_night(service, clock)
    code, out, _ = run("night")
    assert code == 0
    assert "all 9 cases ended ok" in " ".join(out.split())
    service.http.delete(made.headers["location"])
    service.http.post(API, json={**NIGHTLY, "cron": "0 2 * * *", "trouble_flags": ["unsettled"]})
    clock.set("2026-01-01T02:00")
    Scheduler(service.store).look()
    service.fill(service.store.studies.page().studies[0].id)
    Scheduler(service.store).look()
    code, out, _ = run("night")
    assert code == 4
    assert "The motions of 9 cases are unsettled" in " ".join(out.split())
