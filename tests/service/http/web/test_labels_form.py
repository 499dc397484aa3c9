"""The form for name, notes and tags: what is refused is not lost."""

from __future__ import annotations

import html
import re
from typing import TYPE_CHECKING

import pytest

from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_NOTES_LENGTH, MAX_TAG_LENGTH

if TYPE_CHECKING:
    from tests.service.conftest import Service

REFUSED = {
    "tags": "a, " + "x" * (MAX_TAG_LENGTH + 1),
    "name": "n" * (MAX_NAME_LENGTH + 1),
    "notes": "o" * (MAX_NOTES_LENGTH + 1),
}


@pytest.mark.parametrize("field", REFUSED)
def test_what_is_refused_comes_back_as_it_was_typed(service: Service, field: str) -> None:
    study_id = service.submit()
    before = service.get(f"/studies/{study_id}")
    typed = {"name": "Feeder, second try", "notes": "Two lines\nof notes", "tags": "a, b"} | {field: REFUSED[field]}
    answer = service.http.post(f"/studies/{study_id}/labels", data={**typed, "archived": "true"})
    assert answer.status_code == 422
    (form,) = re.findall(r'<details class="screen" id="labels" open>.*?</details>', answer.text, re.DOTALL)
    (notes,) = re.findall(r'<textarea name="notes"[^>]*>(.*?)</textarea>', form, re.DOTALL)
    shown = {name: re.findall(rf'name="{name}" value="([^"]*)"', form)[0] for name in ("name", "tags")}
    assert {name: html.unescape(text) for name, text in {**shown, "notes": notes}.items()} == typed
    assert 'name="archived" value="true" checked' in form
    assert re.findall(r'aria-describedby="untaken:(\w+)"', form) == [field]
    (told,) = re.findall(rf'id="untaken:{field}" role="alert">([^<]+)<', form)
    assert told
    after = service.get(f"/studies/{study_id}")
    assert [after[name] for name in typed] == [before[name] for name in typed]
    # The address of the answer is that of the page when it is loaded again.
    assert service.http.get(f"/studies/{study_id}/labels").headers["location"].endswith(f"/studies/{study_id}")


def test_what_is_taken_is_stored(service: Service) -> None:
    study_id = service.submit()
    service.http.post(f"/studies/{study_id}/labels", data={"name": "Feeder", "notes": "n", "tags": "a, b"})
    after = service.get(f"/studies/{study_id}")
    assert (after["name"], after["notes"], after["tags"]) == ("Feeder", "n", ["a", "b"])
