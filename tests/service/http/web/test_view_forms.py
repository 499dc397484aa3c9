"""Every view of a case and of a study on its page, for every model, and the addresses that led to them before."""

from __future__ import annotations

import html
import json
import re
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qsl, urlsplit

import numpy as np
import pytest

from sprag_study.service.http.web.matters import ASKS, OLD
from sprag_study.service.http.web.motion import PARTS
from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import format_of, load_spec
from sprag_study.service.storage.part import SystemClock
from sprag_study.service.views import trajectory
from sprag_study.service.views.case_questions import CASE_VIEWS
from sprag_study.service.views.setting import settings_of
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from tests.service.calibrating import calibration
from tests.service.registered import create_table, registered
from tests.service.spec_sample import changed
from tests.service.test_toy_model import NAME, DampedOscillator
from tests.service.test_toy_model import SPEC as TOY

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.settings import Settings
    from sprag_study.worker.models import Trajectory
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

SETTLED: dict[str, Any] = changed(
    {"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": [0.2, 0.3]}]}
)
#: What is asked where the usual question takes long, or has no ranges.
ASKED = {
    "branch": {"from": "0.29", "to": "0.31"},
    "diagram": {"points": "3", "strobes": "4"},
    "section": {"strobes": "8"},
    "basin": {
        "x": "pendulums.0.initial_angle", "x_from": "0", "x_to": "0.1", "y": "pendulums.0.initial_speed", "y_from": "0",
        "y_to": "1", "points": "2",
    },
}  # fmt: skip
#: The views that the cases of each model have.
HAVE = {
    "drive": set(PARTS) - {"transient", "speeds"},
    "press": {"transient"},
    "toy": set[str](),
}


@pytest.fixture(autouse=True)
def toy() -> Iterator[None]:
    """The toy model, for the time of a test."""
    with registered(DampedOscillator()):
        yield


@pytest.fixture
def settings(settings: Settings) -> Settings:
    """Settings of a service whose database has the toy model's table."""
    create_table(settings, NAME)
    return settings


def study_of(service: Service, model: str) -> str:
    """A study of a model, with rows."""
    file, text = preset_text("press")
    specs = {"drive": SETTLED, "press": load_spec(text, format_of(file)), "toy": TOY}
    study_id = service.submit(specs[model])
    service.fill(study_id)
    return study_id


@pytest.mark.parametrize("model", HAVE)
def test_every_view_of_a_case_is_on_its_page(service: Service, model: str) -> None:
    # The first machines of the press have no motion at their mean speed.
    own = f"/studies/{study_of(service, model)}/cases/{3 if model == 'press' else 1}"
    first = service.http.get(own)
    assert first.status_code == 200
    assert '<svg class="figure ' in first.text
    assert set(re.findall(r"\?show=(\w+)", first.text)) == HAVE[model]
    for part, view in PARTS.items():
        page = service.http.get(own, params={"show": part, **ASKED.get(part, {})}, headers={"Accept-Language": "uk"})
        assert page.status_code == (200 if part in HAVE[model] else 404), part
        if part not in HAVE[model]:
            continue
        section = page.text.partition(f'<section id="{part}"')[2].partition("</section>")[0]
        assert ('<svg class="figure ' in section) is view.drawn
        assert 'role="alert"' not in section
        for one in settings_of(view.about.question):
            # What is about files only, and a torque where a motor gives it, has no field.
            assert not one.setting.label or f'name="{one.alias}"' in section, one.alias
        if part in {about.name for about in CASE_VIEWS}:
            assert f"/api/v1{own}/{part}?" in section
    assert service.http.get(f"{own}?show=curves").status_code == 404


def test_a_phase_portrait_is_of_the_part_above_which_is_run_once(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = f"/studies/{study_of(service, 'drive')}/cases/1"
    runs: list[tuple[float, float]] = []
    run = trajectory.models.run_trajectory

    def counted(study: Study, case: int, first: float, last: float, points: int) -> Trajectory:
        runs.append((first, last))
        return run(study, case, first, last, points)

    monkeypatch.setattr(trajectory.models, "run_trajectory", counted)
    for part in ({}, {"from": "0.1", "to": "0.3"}):
        assert service.http.get(own, params=part).status_code == 200
        page = service.http.get(own, params={"show": "phases", **part})
        assert page.text.count('<section id="') == 2
        assert len(runs) == 2
        assert len(set(runs)) == 1, "the same part on both pages"
        runs.clear()


@pytest.mark.parametrize("model", HAVE)
def test_files_of_a_motion_have_the_part_that_is_shown(service: Service, model: str) -> None:
    own = f"/studies/{study_of(service, model)}/cases/{3 if model == 'press' else 1}"
    section = service.http.get(own).text.partition('<section id="motion"')[2].partition("</section>")[0]
    link = html.unescape(re.findall(r'href="([^"]*format=json[^"]*)"', section)[0])
    asked = dict(parse_qsl(urlsplit(link).query))
    data = service.http.get(link).json()
    places = data.get("times", data.get("angles"))
    assert len(places) == int(asked["points"]) > 1000
    assert (places[0], places[-1]) == (float(asked["from"]), pytest.approx(float(asked["to"])))
    if model == "drive":
        assert float(asked["from"]) > 0.0, "the last periods"


def test_old_addresses_of_views_lead_to_them_with_their_choices(service: Service) -> None:
    study_id = study_of(service, "drive")
    own = f"/studies/{study_id}/cases/1"
    for part in ("engagements", "branch", "diagram", "basin", "transient"):
        old = service.http.get(f"{own}/{part}?along=shaft.load&from=0.2", follow_redirects=False)
        assert old.status_code == 308
        assert old.headers["location"] == f"{own}?show={part}&along=shaft.load&from=0.2"
    assert {name for name, ask in OLD.items() if ask == "tolerances"} == {"drives", "ribbon", "tolerances", "yield"}
    for name, ask in OLD.items():
        old = service.http.get(f"/studies/{study_id}/{name}?y=efficiency&ask=old", follow_redirects=False)
        assert (old.status_code, old.headers["location"]) == (
            308,
            f"/studies/{study_id}/matters?ask={ask}&y=efficiency",
        )


def test_every_question_about_a_study_is_answered_or_says_how(service: Service) -> None:
    batch = service.submit({**json.loads(preset_text("tolerances")[1]), "drives": 8})
    service.fill(batch)
    answered = {
        study_of(service, "drive"): {"sensitivity"}, study_of(service, "press"): {"sensitivity"},
        study_of(service, "toy"): {"sensitivity"}, batch: {"sensitivity", "tolerances"},
        calibration(service): {"measurement"},
    }  # fmt: skip
    for study_id, known in answered.items():
        own = f"/studies/{study_id}/matters"
        for ask in ASKS:
            for language in ("en", "uk"):
                page = service.http.get(f"{own}?ask={ask}", headers={"Accept-Language": language})
                assert page.status_code == 200
                assert ('<svg class="figure ' in page.text) is (ask in known), (known, ask)
        usual = service.http.get(own)
        assert f'<a href="{own}?ask={list(ASKS)[max(map(list(ASKS).index, known))]}" aria-current="page"' in usual.text
        if "measurement" not in known:
            assert 'name="/calibrate/measured/csv"' in service.http.get(f"{own}?ask=measurement").text
        if "tolerances" not in known:
            assert f'href="/new?clone={study_id}"' in service.http.get(f"{own}?ask=tolerances").text
        assert service.http.get(f"{own}?ask=luck").status_code == 404


def test_what_matters_most_is_said_by_its_numbers(service: Service) -> None:
    """The frequency of the toy follows a closed form; the change is that between the neighbours of the base."""
    study_id = service.submit(TOY)
    store = service.store
    Dispatcher(store.work, InlineExecutor(), SystemClock()).run(lambda: store.studies.get(study_id).state.terminal)
    rates, masses = np.linspace(100.0, 400.0, 4), np.array([0.5, 1.0, 2.0])
    frequency = np.sqrt(rates[:, None] / masses * (1.0 - 0.1**2)) / (2.0 * np.pi)
    along_rate, along_mass = frequency.mean(axis=1), frequency.mean(axis=0)
    changes = {
        "spring_rate": 0.1 * 200.0 * (along_rate[2] - along_rate[0]) / 200.0,
        "mass": 0.1 * 0.5 * (along_mass[1] - along_mass[0]) / 0.5,
    }
    total = {"spring_rate": frequency.var(axis=0).mean(), "mass": frequency.var(axis=1).mean()}
    most = max(total, key=lambda name: total[name])
    page = service.http.get(f"/studies/{study_id}/matters?y=frequency&units=si").text
    said = re.search(r'<p class="say">(.*?)</p>', page, re.DOTALL)
    assert said is not None
    assert f"{100.0 * total[most] / frequency.var():.2g} % of what" in said[1]
    steepest = max(changes.values(), key=abs)
    verb = "lowers" if steepest < 0.0 else "raises"
    assert re.search(rf"10 % more .* {verb} .* by about {abs(steepest):.2g} Hz", said[1])


def test_a_kernel_that_is_not_loaded_does_not_hold_the_page_up(
    service: Service, monkeypatch: pytest.MonkeyPatch
) -> None:
    own = f"/studies/{study_of(service, 'press')}/cases/3"
    monkeypatch.setattr(service.computer, "has_loaded", lambda _shape: False)
    first = service.http.get(own)
    assert (first.status_code, service.computer.loads, "data-later" in first.text) == (200, [], True)
    assert f'<a href="{own}?wait=1">' in first.text, "without scripts"
    again = service.http.get(f"{own}?wait=1")
    assert '<svg class="figure ' in again.text
    assert "data-later" not in again.text
