"""Vocabulary, figures, faults and warnings on pages in Ukrainian."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from sprag_study.service.spec.text import load_spec
from sprag_study.worker import models
from tests.service.figures.seen import seen

if TYPE_CHECKING:
    from tests.service.conftest import Service

UKRAINIAN = {"Accept-Language": "uk", "Accept": "text/html"}


def test_a_case_is_told_in_the_words_of_the_reader(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.http.get(f"/studies/{study_id}/cases/0", headers=UKRAINIAN).text
    for text in ("Зробити варіантом", "Найбільша корисна потужність", "Момент навантаження", "рад/с", "Н·м"):
        assert text in page, text
    # The texts of scripts are named by the English ones.
    shown = re.sub(r"<script.*?</script>", "", page, flags=re.DOTALL)
    for text in ("Make it a variant", "Largest useful power", "rad/s"):
        assert text not in shown, text
    english = service.http.get(f"/studies/{study_id}/cases/0", headers={"Accept": "text/html"}).text
    assert "Make it a variant" in english


def test_figures_have_the_language_of_their_page(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.http.get(f"/compare?study={study_id}", headers=UKRAINIAN).text
    assert seen(page).has("Момент навантаження")
    address = f"/compare/picture.svg?study={study_id}"
    figure = service.http.get(address, headers={"Accept-Language": "uk"})
    assert seen(figure.text).has("Момент навантаження")
    known = {"If-None-Match": figure.headers["etag"]}
    assert service.http.get(address, headers={"Accept-Language": "uk", **known}).status_code == 304
    english = service.http.get(address, headers={"Accept-Language": "en", **known})
    assert seen(english.text).has("Load torque")


def test_fields_examples_and_choices_are_as_they_are_typed(service: Service) -> None:
    study_id = service.submit()
    case = f"/studies/{study_id}/cases/0"
    motion, branch, components = (
        service.http.get(address, headers=UKRAINIAN).text for address in (case, f"{case}?show=branch", "/parts")
    )
    assert "один період — " in motion
    assert re.search(r'placeholder="[^"]* Н/мм?"', components)
    assert '<option value="shaft.load" selected>Момент навантаження</option>' in branch
    assert '<option value="pendulums.0.mass">' in branch
    assert (
        "<option selected>shaft.load,gravity</option>"
        in service.http.get(f"{case}?show=branch&along=shaft.load,gravity").text
    )


def test_choices_of_a_machine_are_in_words_with_their_code_names_in_titles(service: Service) -> None:
    study_id = service.submit(load_spec(Path("examples/press.toml").read_text("utf-8"), "toml"))
    english = service.http.get(f"/studies/{study_id}", headers={"Accept": "text/html"}).text
    assert '<td class="num" title="slider_crank">slider crank</td>' in english
    assert (
        'title="slider_crank">кривошипно-повзунний' in service.http.get(f"/studies/{study_id}", headers=UKRAINIAN).text
    )


def test_what_only_scripts_can_do_is_told_where_scripts_run(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    page = service.http.get(f"/studies/{study_id}/rows", headers={"Accept": "text/html"}).text
    told = re.findall(r'<span class="([^"]*)">[^<]*(?:click|drag)[^<]*</span>', page)
    assert told
    assert all("script" in classes.split() for classes in told)


def test_a_fault_of_a_page_is_a_whole_sentence(service: Service) -> None:
    study_id = service.submit()
    answer = service.http.get(f"/studies/{study_id}?x=nope", headers=UKRAINIAN)
    assert answer.status_code == 422
    alert = answer.text.partition('role="alert"')[2].partition("</div>")[0]
    assert "не є віссю цього дослідження" in alert
    assert "nope" in alert
    assert "допустимо: excitation.frequency, shaft.load" in alert
    english = service.http.get(f"/studies/{study_id}?x=nope", headers={"Accept": "text/html"}).text
    assert "віссю" not in english


def test_the_working_point_and_the_date_of_the_report_are_as_written(service: Service) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"/studies/{study_id}?x=shaft.load&at=excitation.frequency%3D16+Hz"
    page = service.http.get(f"{address}&point=150.5+N*mm", headers=UKRAINIAN).text
    told = page.partition('id="say"')[2].partition("</p>")[0]
    assert "При 0,1505 Н·м випадку не обчислено. При 0,1 Н·м вал обертається" in told
    assert re.search(r'class="script" min="0\.02" max="0\.3" step="any" value="0\.1505"', page)
    typed = service.http.get(f"{address}&point=0,15+Н·м", headers={"Accept-Language": "en"}).text
    assert "No case was run at 0.15 N·m." in typed
    report = service.http.get(f"/studies/{study_id}/document", headers=UKRAINIAN).text
    assert re.search(r'name="date" form="document" value="\d\d\.\d\d\.\d{4}"', report)


def test_a_number_of_a_case_that_there_is_not_is_told_in_the_language_of_the_page(service: Service) -> None:
    answer = service.http.get(f"/studies/{service.submit()}/cases/99999", headers=UKRAINIAN)
    assert answer.status_code == 404
    assert re.search(r"Випадки цього дослідження — від 0 до \d+\.", answer.text)


def test_a_speed_is_no_code_name_in_what_results_mean() -> None:
    for model in models.model_names():
        for info in models.result_catalogue(model):
            assert not re.search(r"\bomega(\b|_)", info.description), info
