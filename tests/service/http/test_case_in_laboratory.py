"""The way from the page of a case to a new study."""

from __future__ import annotations

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.text import load_spec
from tests.service.conftest import Service
from tests.service.rounds import computed


def test_a_machine_without_a_motion_has_no_link_but_a_sentence(service: Service) -> None:
    study_id = computed(service, load_spec(preset_text("press")[1], "toml"))
    found = service.get(f"/studies/{study_id}/cases", page_size=100)["cases"]
    endings = {row["ending"]: row["case"] for row in found}
    assert set(endings) == {"ok", "inertia_insufficient"}
    for ending, case in endings.items():
        page = service.http.get(f"/studies/{study_id}/cases/{case}").text
        linked = f'href="/studies/{study_id}/cases/{case}/laboratory"' in page
        assert linked == (ending == "ok")
        assert ("This machine has no motion at its mean speed." in page) == (ending != "ok")
