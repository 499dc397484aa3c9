"""Decimal commas and Cyrillic units in addresses, on pages and in options, which all read quantities in one way."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.faults import SelectionError
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import values_of
from sprag_study.service.results.selection import value_of

if TYPE_CHECKING:
    from tests.service.conftest import Service


def test_ranges_of_explore_and_values_of_curves(service: Service, spec: dict[str, Any]) -> None:
    loads = {"path": "shaft.load", "values": [0.1, 0.25, 0.4]}
    study_id = service.submit({**spec, "axes": [loads]})
    service.fill(study_id)
    for text in ("250,5 Н·мм", "0,2505", "0.2505 N*m"):
        assert service.get(f"/studies/{study_id}/explore", where=f"shaft.load <= {text}")["selected"] == 2
    page = service.http.get(f"/studies/{study_id}/rows?max:shaft.load=0,2505").text
    assert '<b role="status">2 of 3 cases</b>' in page
    assert value_of("shaft.load", "250,0 Н*мм", "N*m") == 0.25
    with pytest.raises(SelectionError) as caught:
        value_of("shaft.load", "1,234", "N*m")
    assert caught.value.faults[0].code == "ambiguous-comma"


def test_the_form_reads_them_and_keeps_what_was_typed(service: Service, spec: dict[str, Any]) -> None:
    values = {**empty("vibration-drive"), **values_of(spec)}
    values |= {"/base/excitation/frequency": "1500,5 об/мин", "/base/pendulums/0/backlash": "0,3 град"}
    values |= {"/base/pendulums/0/spring_rate": "9 Н/мм", "/base/pendulums/0/mass": "0,5", "do": "submit"}
    values |= {"/run/at_most": "", "/run/max_period": "", "/run/settled": ""}  # the run has a given time
    answer = service.http.post("/new", data=values, follow_redirects=False)
    assert answer.status_code == 303, answer.text
    study_id = answer.headers["location"].rpartition("/")[2]
    base = service.store.studies.study(study_id).base
    assert base["excitation.frequency"] == pytest.approx(1500.5 / 60)
    assert base["pendulums.0.spring_rate"] == 9000.0
    assert base["pendulums.0.mass"] == 0.5
    kept = values_of(service.store.studies.spec(study_id))
    assert kept["/base/pendulums/0/backlash"] == "0,3 град"
    refused = service.http.post("/new", data={**values, "/base/pendulums/0/mass": "1,234 кг"})
    assert refused.status_code == 422
    assert "separate thousands" in refused.text
