"""Texts in the place of a whole number that Python calls digits, or refuses to read."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.http.web.form.spec import values_of

if TYPE_CHECKING:
    from tests.service.conftest import Service


@pytest.mark.parametrize("text", ["1e9999999", "1e-9999999", "1e400"])
def test_an_exponent_that_no_number_has_is_refused(service: Service, spec: dict[str, Any], text: str) -> None:
    study_id = service.submit(spec)
    service.fill(study_id)
    ends = {"min:shaft.speed.mean": text, "max:shaft.speed.mean": text}
    for given in ({"least": text}, ends):
        answer = service.http.get(f"/studies/{study_id}/rows", params=given, headers={"Accept": "text/html"})
        assert answer.status_code < 500
    assert answer.status_code == 422


@pytest.mark.parametrize("text", ["²", "٣", "9" * 5000])
def test_what_is_no_whole_number_is_refused_or_has_no_effect(service: Service, spec: dict[str, Any], text: str) -> None:
    study_id = service.submit(spec)
    service.fill(study_id)
    own = f"/studies/{study_id}"
    http, page = service.http, {"Accept": "text/html"}
    assert http.get(f"{own}/cases/1", params={"points": text}, headers=page).status_code == 422
    assert http.post(f"{own}/rows/longer", data={"case": [text]}, headers=page).status_code == 422
    begun = {"clone": study_id, f"clutch.coefficients.{text}": "1"}
    assert http.get("/new", params=begun, headers=page).status_code == 200
    sent = {**values_of(spec), "do": f"drop-axes {text}"}
    assert http.post("/new", data=sent, headers=page).status_code in (200, 422)
