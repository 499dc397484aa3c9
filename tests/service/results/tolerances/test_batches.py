"""Ribbons, yield, causes and worst drives of a linear drive, from the spec to every form of the answer."""

from __future__ import annotations

import csv
import io
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy.stats import norm

from sprag_study.service.answers import tolerances as shapes
from sprag_study.service.presets import preset_text
from sprag_study.service.results.tolerances.batch import Asked
from sprag_study.service.results.tolerances.conditions import first_condition
from sprag_study.service.results.tolerances.yields import yields
from sprag_study.service.spec.document import load_spec, parse_spec
from tests.service.conftest import API
from tests.service.results.tolerances.conftest import DEVIATION, MEAN, SPEC, finish
from tests.service.shapes import fits

if TYPE_CHECKING:
    from tests.service.conftest import Service


def test_ribbons_are_those_of_the_closed_form(service: Service) -> None:
    study_id = finish(service, SPEC)
    found = service.get(f"/studies/{study_id}/ribbon", y="speed")
    fits(shapes.RibbonReport, found)
    assert (found["drives"], found["quantiles"], found["x"]) == (512, [0.05, 0.5, 0.95], {"path": "load", "unit": "m"})
    (line,) = found["lines"]
    speed, loads = line["results"]["speed"], np.linspace(0.0, 8.0, 5)
    assert line["x"] == loads.tolist()
    assert speed["nominal"] == pytest.approx(MEAN - loads)
    assert speed["drives"] == [512] * 5
    for index, probability in enumerate(found["quantiles"]):
        exact = MEAN - loads + norm.ppf(probability) * DEVIATION
        assert speed["values"][index] == pytest.approx(exact, abs=0.15)
        assert (np.array(speed["low"][index]) <= exact).all()
        assert (exact <= np.array(speed["high"][index])).all()
    shares = {item["tolerance"]: item for item in speed["causes"]["shares"]}
    for name, exact in (("first", 9 / 14), ("second", 4 / 14), ("third", 1 / 14)):
        assert abs(shares[name]["share"] - exact) <= shares[name]["error"] < 0.1
    assert speed["causes"]["rest"] == pytest.approx(0.0, abs=0.05)
    # The same draws at all places: the lowest drive is the lowest everywhere.
    lowest = speed["lowest"][0]
    row = service.get(f"/studies/{study_id}/cases/{lowest['case']}")
    assert row["parameters"]["drive"] == lowest["drive"]
    assert row["results"]["speed"] == pytest.approx(lowest["value"], rel=1e-12)


def test_yield_is_that_of_the_closed_form(service: Service) -> None:
    study_id = finish(service, SPEC)
    for short in ("speed>=90% nominal", "speed >= 90 % of the nominal"):
        (read,) = service.get(f"/studies/{study_id}/yield", condition=short)["conditions"]
        assert read["text"] == "speed ≥ 90 % of nominal"
    found = service.get(f"/studies/{study_id}/yield", condition=["speed >= 90 % of nominal", "speed<=65 m"], worst=3)
    fits(shapes.YieldReport, found)
    assert [item["text"] for item in found["conditions"]] == ["speed ≥ 90 % of nominal", "speed ≤ 65 m"]
    (line,) = found["lines"]
    nominal = MEAN - np.linspace(0.0, 8.0, 5)
    exact = norm.cdf((65.0 - nominal) / DEVIATION) - norm.cdf(-0.1 * nominal / DEVIATION)
    for share, value in zip(line["each"], exact, strict=True):
        assert share["value"] == pytest.approx(value, abs=0.02)
        assert share["low"] <= value <= share["high"]
        assert share["drives"] == 512
    # A drive reaches both everywhere if it is fast enough at the largest load, and not too fast without one.
    both = norm.cdf(5.0 / DEVIATION) - norm.cdf(-0.1 * nominal[-1] / DEVIATION)
    assert line["all"]["value"] == pytest.approx(both, abs=0.02)
    assert line["nominal"] == [True] * 5
    worst = line["worst"]
    assert [one["margin"] for one in worst] == sorted(one["margin"] for one in worst)
    row = service.get(f"/studies/{study_id}/cases/{worst[0]['case']}")
    assert row["results"]["speed"] == worst[0]["results"]["speed"]
    assert row["parameters"]["drive"] == worst[0]["drive"]
    assert set(worst[0]["draws"]) == {"first", "second", "third"}
    draws = service.store.studies.study(study_id).spread
    assert draws is not None
    assert list(worst[0]["draws"].values()) == draws.array[worst[0]["drive"] - 1].tolist()


def test_drives_that_fail_are_failed_drives(service: Service) -> None:
    # A third of the measured values lets the drive fail.
    tolerances = [{"path": "third", "values": [9, 11, 200]}, {"path": "first", "plus_minus": "3 m"}]
    study_id = finish(service, {**SPEC, "tolerances": tolerances, "drives": 256, "draws": "random"})
    study = service.store.studies.study(study_id)
    assert study.spread is not None
    failed = int((study.spread.array[:, study.spread.names.index("third")] > 100.0).sum())
    assert failed > 50
    (line,) = service.get(f"/studies/{study_id}/ribbon", y="speed")["lines"]
    assert line["failed"] == [failed] * 5
    assert line["results"]["speed"]["drives"] == [256 - failed] * 5
    assert f"left out of the shares: {failed}" in line["results"]["speed"]["causes"]["note"]
    (line,) = service.get(f"/studies/{study_id}/yield", condition="speed >= -1000 m", worst=2)["lines"]
    assert line["all"]["reached"] == 256 - failed
    assert line["all"]["drives"] == 256
    assert [(one["margin"], one["results"]) for one in line["worst"]] == [(None, {"speed": None})] * 2
    shares = {item["tolerance"]: item["share"] for item in line["causes"]["shares"]}
    assert shares["third"] == pytest.approx(1.0, abs=1e-6)
    assert abs(shares["first"]) < 0.1


def test_places_are_chosen_as_those_of_curves(service: Service) -> None:
    axes = [*SPEC["axes"], {"path": "grade", "values": [1, 2, 4]}]
    study_id = finish(service, {**SPEC, "axes": axes, "drives": 64})
    own = f"/studies/{study_id}"
    lines = service.get(f"{own}/ribbon", x="load", by="grade")["lines"]
    assert [line["by"] for line in lines] == [{"grade": 1.0}, {"grade": 2.0}, {"grade": 4.0}]
    medians = [line["results"]["speed"]["values"][1] for line in lines]
    assert medians[2] == pytest.approx(4.0 * np.array(medians[0]))
    (single,) = service.get(f"{own}/ribbon", at=["load=4", "grade=2"])["lines"]
    assert (single["x"], single["at"], len(single["cases"])) == ([], {"load": 4.0, "grade": 2.0}, 1)
    assert single["results"]["speed"]["values"][1] == [medians[1][2]]
    # Too few for an end of the interval.
    assert single["results"]["speed"]["low"][0] == [None]
    (held,) = service.get(f"{own}/yield", condition="speed >= 100 m", x="load", at="grade=2")["lines"]
    assert held["at"] == {"grade": 2.0}
    for query in ("x=drive", "x=load&by=drive", "at=drive=1", "x=load", "x=nothing", "quantile=1.5"):
        assert service.http.get(f"{API}{own}/ribbon?{query}").status_code == 422, query
    for condition in ("speed", "speed > 3", "sped >= 3 m", "speed >= 3 kg", "speed = 3 m", "speed >= x % of nominal"):
        answer = service.http.get(f"{API}{own}/yield", params={"condition": condition})
        assert answer.status_code == 422, condition
        assert "condition" in answer.text
    assert service.get(f"{own}/yield", condition="marks = 60", at=["load=0", "grade=1"])["lines"][0]["x"] == []


@pytest.mark.parametrize("axes", ["table", "none"])
def test_tables_and_single_places_have_ribbons(service: Service, axes: str) -> None:
    chosen: dict[str, Any] = {
        "table": {"axes": [{"points": "load,grade\n0,1\n4,2\n8,1\n"}]},
        "none": {"axes": []},
    }[axes]
    study_id = finish(service, {**SPEC, **chosen, "drives": 128})
    lines = service.get(f"/studies/{study_id}/ribbon")["lines"]
    # The machines of the table have a ribbon each: of grade 1 with loads of 0 and 8, and of grade 2.
    every = {"table": [[60.0, 52.0], [112.0]], "none": [[59.0]]}[axes]
    for line, nominal in zip(lines, every, strict=True):
        assert line["results"]["speed"]["nominal"] == nominal
        assert line["results"]["speed"]["values"][1] == pytest.approx(nominal, abs=1.0)
    assert service.http.get(f"/studies/{study_id}").status_code == 200


def test_correlated_tolerances_have_no_shares(service: Service) -> None:
    correlations = [{"between": ["first", "second"], "coefficient": 0.8}]
    study_id = finish(service, {**SPEC, "correlations": correlations})
    causes = service.get(f"/studies/{study_id}/ribbon", y="speed")["lines"][0]["results"]["speed"]["causes"]
    assert [item["share"] is None for item in causes["shares"]] == [True, True, False]
    # Var = 9 + 4 + 2 * 0.8 * 3 * 2 + 1.
    assert causes["shares"][2]["share"] == pytest.approx(1 / 23.6, abs=0.03)
    assert causes["note"] == "first, second are correlated: they have no shares of their own"
    page = service.http.get(f"/studies/{study_id}/matters").text
    assert "The first parameter, the second parameter are correlated: they have no shares of their own." in page
    assert causes["rest"] is None


def test_unfinished_studies_tell_what_is_run(service: Service) -> None:
    study_id = service.submit({**SPEC, "drives": 8})
    (line,) = service.get(f"/studies/{study_id}/ribbon")["lines"]
    assert (line["pending"], line["results"]["speed"]["values"][1]) == ([8] * 5, [None] * 5)
    (line,) = service.get(f"/studies/{study_id}/yield", condition="speed >= 1 m")["lines"]
    assert (line["all"]["value"], line["worst"]) == (None, [])


def test_tables_and_pictures_show_the_same(service: Service) -> None:
    axes = [*SPEC["axes"], {"path": "grade", "values": [1, 2]}]
    study_id = finish(service, {**SPEC, "axes": axes, "drives": 64})
    place = f"{API}/studies/{study_id}"
    ribbon, yields = f"{place}/ribbon?x=load&by=grade&y=speed", f"{place}/yield?x=load&by=grade&condition=speed>=50 m"
    rows = list(csv.DictReader(io.StringIO(service.http.get(f"{ribbon}&format=csv").text)))
    lines = service.http.get(ribbon).json()["lines"]
    assert [float(row["speed 50 % high"]) for row in rows] == [
        value for line in lines for value in line["results"]["speed"]["high"][1]
    ]
    rows = list(csv.DictReader(io.StringIO(service.http.get(f"{yields}&format=csv").text)))
    lines = service.http.get(yields).json()["lines"]
    shares = [share["value"] for line in lines for share in [*line["each"], line["all"]]]
    assert [float(row["yield"]) for row in rows] == shares
    assert [row["case"] for row in rows[5:6]] == [""]
    single = f"{place}/ribbon?at=load=4&at=grade=2"
    forms = {"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}
    for form, start in forms.items():
        assert service.http.get(f"{ribbon}&format={form}").content.startswith(start), form
    for address in (f"{ribbon}&map=true", yields, f"{yields}&map=true", single):
        assert service.http.get(f"{address}&format=svg").content.startswith(forms["svg"]), address
    assert service.http.get(f"{ribbon}&map=true&quantile=0.1&quantile=0.9").status_code == 422


def test_curves_and_sensitivity_show_the_nominal_drive(service: Service) -> None:
    study_id = finish(service, {**SPEC, "drives": 16})
    own = f"/studies/{study_id}"
    for query in ({}, {"x": "load", "y": "speed"}, {"x": "load"}):
        (curve,) = service.get(f"{own}/curves", **query)["curves"]
        assert curve["y"]["speed"] == [60.0, 58.0, 56.0, 54.0, 52.0]
        assert curve["at"] == {"drive": 0.0}
    (curve,) = service.get(f"{own}/curves", x="load", y="speed", at="drive=3")["curves"]
    assert curve["y"]["speed"] != [60.0, 58.0, 56.0, 54.0, 52.0]
    (found,) = service.get(f"{own}/sensitivity", y="speed")["results"]
    assert ([effect["paths"] for effect in found["effects"]], found["cases"]) == ([["load"]], 5)
    assert service.get(own)["warnings"] == []


def test_the_page_shows_ribbon_yield_and_the_worst_drives(service: Service) -> None:
    axes = [*SPEC["axes"], {"path": "grade", "values": [1, 2]}]
    study_id = finish(service, {**SPEC, "axes": axes, "drives": 128})
    own = f"/studies/{study_id}"
    text = service.http.get(f"{own}/matters?ask=tolerances").text
    answer = service.get(f"{own}/yield", condition="speed >= 90 % of nominal", x="load", at="grade=1")
    (line,) = answer["lines"]
    assert f"{100 * line['all']['value']:.1f} % of 128 drives" in text
    for one in line["worst"]:
        assert f'<a href="{own}/cases/{one["case"]}">{one["drive"]}</a>' in text
    asked = {"x": "load", "by": "grade", "quantile": "10 %; 0.9", "condition": "speed >= 50 m\r\nspeed <= 70 m"}
    text = service.http.get(f"{own}/matters", params={"ask": "tolerances", **asked}).text
    assert 'value="10 %; 0.9"' in text
    assert "The grade parameter = 2" in text
    for wrong in ({"quantile": "5 %, 120 %"}, {"condition": "speed > 3"}, {"x": "first"}):
        refused = service.http.get(f"{own}/matters", params={"ask": "tolerances", **wrong})
        assert refused.status_code == 422, wrong
        assert 'role="alert"' in refused.text
        assert next(iter(wrong.values())).replace(">", "&gt;") in refused.text
    report = service.http.get(f"{API}{own}/report", params={"format": "html", "appendix": "drives"}).text
    assert '<img src="data:image/svg+xml;base64,' in report.partition("<h2>Drives</h2>")[2]
    both = service.get(f"{own}/yield", condition="speed >= 90 % of nominal")["lines"]
    for line in both:
        place = f"The grade parameter = {1000 * line['by']['grade']:g} mm: "
        assert f">{place}" in text
        assert f"{place}{100 * line['all']['value']:.1f} % of 128 drives" in report
    assert service.http.get(f"{API}{own}/report", params={"format": "pdf"}).content.startswith(b"%PDF")
    plain = service.submit({key: value for key, value in SPEC.items() if key not in ("tolerances", "drives", "seed")})
    assert "This study has no tolerances." in service.http.get(f"/studies/{plain}/matters?ask=tolerances").text


def test_of_the_half_nearest_to_nominal_as_many_are_good_as_the_closed_form_says(service: Service) -> None:
    study_id = finish(service, {**SPEC, "axes": []})
    own = service.store.studies.study(study_id)
    found = yields(own, ["speed >= 58 m"], Asked(), 0, partial(
        service.store.rows.for_cases, study_id))  # fmt: skip
    (line,) = found.lines
    # A draw of the half has a standard score of at most 0.6745; the base is 59 m.
    score = norm.ppf(np.linspace(0.25, 0.75, 1001))
    for place, deviation in enumerate((3.0, 2.0, 1.0)):
        exact = norm.cdf((1.0 + deviation * score) / np.sqrt(DEVIATION**2 - deviation**2)).mean()
        assert line.nearest.low[place] <= exact <= line.nearest.high[place]
    assert line.nearest.drives.tolist() == [256] * 3
    page = service.http.get(f"/studies/{study_id}/matters", params={"condition": "speed >= 58 m"}).text
    rows = page.partition("<caption>Where the spread of ")[2].partition("</table>")[0]
    assert f'<td class="num">{100.0 * line.nearest.value[0]:.3g}</td>' in rows


def test_drives_of_which_nine_of_ten_are_good_are_as_near_to_nominal_as_the_closed_form_says(service: Service) -> None:
    study_id = finish(service, {**SPEC, "axes": [], "drives": 4096})
    own = service.store.studies.study(study_id)
    found = yields(own, ["speed >= 55 m"], Asked(), 0, partial(
        service.store.rows.for_cases, study_id))  # fmt: skip
    (line,) = found.lines
    # A first parameter within so many standard deviations of 1 m; the base is 59 m.
    within = norm.cdf(line.within[0])
    score = norm.ppf(np.linspace(1.0 - within, within, 1001))
    assert norm.cdf((4.0 + 3.0 * score) / np.sqrt(5.0)).mean() == pytest.approx(0.9, abs=0.01)
    assert np.isnan(line.within[2]), "the third is not what makes drives bad"
    page = service.http.get(f"/studies/{study_id}/matters", params={"condition": "speed >= 55 m", "units": "si"}).text
    assert f"<td>±{line.within[0]:.3g} m</td>" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert "not by it alone" in page


def test_a_page_begins_with_the_side_of_the_nominal_drive_that_is_worse() -> None:
    shaft = parse_spec(load_spec(preset_text("press")[1], "toml")).study
    drive = parse_spec(load_spec(preset_text("one_pendulum")[1], "json")).study
    assert first_condition(shaft, "irregularity") == "irregularity <= 110 % of nominal"
    assert first_condition(drive, "efficiency") == "efficiency >= 90 % of nominal"
