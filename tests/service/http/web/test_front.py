"""The designs of a search: their figure, and the way from a design to a study of its own."""

from __future__ import annotations

import re

import pytest

from sprag_study.service.http.web.form.sent import settle
from sprag_study.service.http.web.form.spec import spec_of
from sprag_study.service.spec.design import design_spec
from sprag_study.service.spec.document import parse_spec
from tests.service.conftest import Service
from tests.service.figures.seen import chart_of, seen
from tests.service.http.web.controls import Controls
from tests.service.searching import search


def test_the_scatter_has_every_design_that_has_not_failed(service: Service) -> None:
    study_id = search(service)
    designs = service.get(f"/studies/{study_id}/front")["designs"]
    (panel,) = chart_of(service.http.get(f"/studies/{study_id}").text).panels
    assert sorted(panel.cases) == sorted(item["cases"][0] for item in designs if None not in item["goals"].values())
    assert panel.curves == []
    axes = {"x": "excitation.frequency", "y": "shaft.speed.mean"}
    other = seen(service.http.get(f"/api/v1/studies/{study_id}/front", params={**axes, "format": "svg"}).text)
    assert other.has("Excitation frequency (Hz)", "front", "feasible")
    numbered = {"x": "design", "format": "svg", "language": "uk"}
    ukrainian = seen(service.http.get(f"/api/v1/studies/{study_id}/front", params=numbered).text)
    assert ukrainian.has("Варіант")


def test_designs_that_serve_the_derivatives_of_the_polish_are_not_listed(service: Service) -> None:
    study_id = search(service)
    first = next(one for one in service.store.studies.rounds(study_id) if one.summary.get("phase") == "polish")
    answer = service.get(f"/studies/{study_id}/front")
    cases = {case for item in answer["designs"] for case in item["cases"]}
    assert len(first.cases) > 0
    assert cases | set(first.cases) == set(range(service.store.studies.get(study_id).cases))
    assert not cases & set(first.cases)
    assert answer["counts"]["known"] == len(answer["designs"])


def test_a_design_becomes_a_study_of_its_own(service: Service) -> None:
    study_id = search(service, rounds=1)
    study, spec = service.store.studies.study(study_id), service.store.studies.spec(study_id)
    alone = parse_spec(design_spec(spec, study, 5)).study
    assert (alone.cases, alone.plan) == (1, None)
    assert {path: alone.base[path] for path in study.axis_paths} == study.case_parameters(5)
    along = parse_spec(design_spec(spec, study, 5, "shaft.load")).study
    assert along.axes[0].values[0] == 0.0
    assert along.axes[0].values[-1] == 2.0 * study.case_parameters(5)["shaft.load"]
    stiff = parse_spec(design_spec(spec, study, 5, "shaft.inertia")).study  # 0 is not allowed
    assert 0.0 < stiff.axes[0].values[0] < 0.1 * stiff.axes[0].values[-1]
    form = service.http.get(f"/new?clone={study_id}&case=5&along=shaft.load").text
    inertia = study.case_parameters(5)["shaft.inertia"]
    begun = parse_spec(spec_of(Controls(form).values)[0]).study
    assert begun.base["shaft.inertia"] == pytest.approx(inertia, rel=1e-12)
    assert 'value="search, design of case 5"' in form
    assert service.http.get(f"/new?clone={study_id}&case=99").status_code == 404


def test_a_design_is_taken_over_in_the_units_of_its_study_with_every_digit(service: Service) -> None:
    study_id = search(service, rounds=1)
    study, spec = service.store.studies.study(study_id), service.store.studies.spec(study_id)
    base = design_spec(spec, study, 5)["base"]
    assert re.fullmatch(r"[0-9.]+ mm", base["excitation"]["amplitude_x"])
    form = Controls(service.http.get(f"/new?clone={study_id}&case=5").text).values
    settle(form)
    begun, case = parse_spec(spec_of(form)[0]).study, study.case_parameters(5)
    assert {path: begun.base[path] for path in case if path in begun.base} == {
        path: value for path, value in case.items() if path in begun.base
    }
