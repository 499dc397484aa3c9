"""Vocabulary, figures, faults and warnings on pages in Ukrainian."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.service.conftest import Service

UKRAINIAN = {"Accept-Language": "uk", "Accept": "text/html"}


def test_a_case_is_told_in_the_words_of_the_reader(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.http.get(f"/studies/{study_id}/cases/0", headers=UKRAINIAN).text
    for text in ("Запуск дійшов до кінця.", "Найбільша корисна потужність", "Момент навантаження", "рад/с", "Н·м"):
        assert text in page, text
    # The texts of scripts are named by the English ones.
    shown = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for text in ("The run reached its end.", "Largest useful power", "rad/s"):
        assert text not in shown, text
    english = service.http.get(f"/studies/{study_id}/cases/0", headers={"Accept": "text/html"}).text
    assert "The run reached its end." in english


def test_figures_have_the_language_of_their_page(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"/studies/{study_id}/figures/curves"
    figure = service.http.get(address, headers={"Accept-Language": "uk"})
    assert figure.json()["layout"]["xaxis"]["title"]["text"].startswith("Момент навантаження")
    assert figure.json()["layout"]["separators"].startswith(",")
    known = {"If-None-Match": figure.headers["etag"]}
    assert service.http.get(address, headers={"Accept-Language": "uk", **known}).status_code == 304
    english = service.http.get(address, headers={"Accept-Language": "en", **known})
    assert english.json()["layout"]["xaxis"]["title"]["text"].startswith("Load torque")


def test_a_fault_of_a_page_is_the_meaning_of_its_code(service: Service) -> None:
    study_id = service.submit()
    answer = service.http.get(f"/studies/{study_id}/curves?x=nope", headers=UKRAINIAN)
    assert answer.status_code == 422
    alert = answer.text.partition('role="alert"')[2].partition("</div>")[0]
    assert "Шлях не є віссю дослідження" in alert
    assert "nope" in alert
    english = service.http.get(f"/studies/{study_id}/curves?x=nope", headers={"Accept": "text/html"}).text
    assert "Шлях" not in english


def test_the_working_point_and_the_date_of_the_report_are_as_written(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"/studies/{study_id}?x=shaft.load&at=excitation.frequency%3D16+Hz"
    page = service.http.get(f"{address}&point=150.5+N*mm", headers=UKRAINIAN).text
    heading = page.partition('<h2 class="minor">')[2].partition("</h2>")[0]
    assert "150,5 Н·мм" in heading
    assert 'name="point" value="150.5 N*mm"' in page
    assert re.search(r'name="date" size="10" maxlength="200" value="\d\d\.\d\d\.\d{4}"', page)
