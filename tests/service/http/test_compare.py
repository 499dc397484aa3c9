"""Studies compared on a page: inputs that differ, curves and their differences, files."""

from __future__ import annotations

import copy
import csv
import html
import io
import re
from typing import Any

import numpy as np
import pytest

from sprag_study.service.answers.differing import COMPONENTS, MOST_COMPARED, NO_PARAMETERS, common_axes, unique_names
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.wording import number
from sprag_study.service.spec.components import KINDS
from sprag_study.service.spec.text import load_spec
from sprag_study.worker import models
from tests.service.conftest import Service
from tests.service.figures.seen import seen
from tests.service.timed_spec import SPEC

X, Y = "shaft.load", "shaft.speed.mean"
FREQUENCY = {"path": "excitation.frequency", "values": ["20 Hz", "22 Hz"]}


def submit(service: Service, name: str, loads: list[float], mass: str = "0.5 kg") -> str:
    """An ended study of two frequencies over loads."""
    spec = copy.deepcopy(SPEC)
    spec["base"]["pendulums"][0]["mass"] = mass
    made = service.submit({**spec, "name": name, "axes": [{"path": X, "values": loads}, FREQUENCY]})
    service.fill(made)
    return made


@pytest.fixture
def three(service: Service) -> list[str]:
    return [
        submit(service, "first", [0.1, 0.2, 0.4]),
        submit(service, "second & best", [0.1, 0.3, 0.4, 0.9], "0.6 kg"),
        submit(service, "third", [0.1, 0.2, 0.4], "700 g"),
    ]


def rows(service: Service, studies: list[str], **query: Any) -> list[dict[str, str]]:
    answer = service.http.get("/compare/curves.csv", params={"study": studies, "x": X, "y": Y, **query})
    assert answer.status_code == 200, answer.text
    assert "attachment" in answer.headers["content-disposition"]
    return list(csv.DictReader(io.StringIO(answer.text)))


def curve(service: Service, study_id: str, frequency: str) -> tuple[list[float], list[float]]:
    """Points of one curve, NaN where there is no result."""
    found = service.get(f"/studies/{study_id}/curves", x=X, y=Y, at=f"excitation.frequency={frequency}")["curves"][0]
    return found["x"], [np.nan if y is None else y for y in found["y"][Y]]


def test_values_that_cannot_be_read_leave_the_page_with_its_choices(service: Service, three: list[str]) -> None:
    query = {"study": three, "by": "excitation.frequency", "of": "excitation.frequency=abc"}
    page = service.http.get("/compare", params=query, headers={"Accept": "text/html"})
    assert page.status_code == 422
    assert 'role="alert"' in page.text
    assert "Other curves" in page.text
    assert "Inputs that differ" in page.text


def test_the_page_lists_the_inputs_that_differ(service: Service, three: list[str]) -> None:
    page = service.http.get("/compare", params={"study": three, "units": "typed"})
    assert page.status_code == 200
    table = page.text[page.text.index('id="inputs"') :]
    mass = '<th scope="row" title="pendulums.0.mass">Mass</th>'
    assert f"{mass}<td>0.5 kg</td><td>0.6 kg</td><td>700 g</td>" in table
    loads = '<th scope="row" title="shaft.load">Load torque</th>'
    assert f"{loads}<td>0.1; 0.2; 0.4 N·m</td><td>0.1; 0.3; 0.4; 0.9 N·m</td><td>0.1; 0.2; 0.4 N·m</td>" in table
    assert "axes." not in table
    assert "Excitation frequency" not in table
    assert "base.shaft" not in table
    heads = re.findall(r'<a href="/studies/(\w+)">(.*?)</a><small>(.*?)</small>', table)
    named = [("mass 0.5 kg", "first"), ("mass 0.6 kg", "second &amp; best"), ("mass 0.7 kg", "third")]
    assert heads == [(study, *names) for study, names in zip(three, named, strict=True)]
    same = service.http.get("/compare", params={"study": [three[0], submit(service, "x", [0.1, 0.2, 0.4])]}).text
    assert "The inputs of these studies are the same." in same


def test_inputs_are_compared_in_the_units_of_the_reader(service: Service) -> None:
    def stiff(rate: object) -> str:
        spec = copy.deepcopy(SPEC)
        spec["base"]["pendulums"][0]["spring_rate"] = rate
        return service.submit({**spec, "name": f"rate {rate}"})

    def table(*studies: str, units: str) -> str:
        return str(service.http.get("/compare", params={"study": studies, "units": units}).text.partition("<main")[2])

    soft, other, same = stiff("9 N/mm"), stiff(9500), stiff(9000)
    caption = '<th scope="row" title="pendulums.0.spring_rate">Spring rate</th>'
    assert f"{caption}<td>9 N/mm</td><td>9500 N/m</td>" in table(soft, other, units="typed")
    assert f"{caption}<td>9000 N/m</td><td>9500 N/m</td>" in table(soft, other, units="si")
    assert "spring_rate" not in table(soft, same, units="si")


def test_errors_of_single_results_are_compared(service: Service) -> None:
    def asking(error: str, **more: object) -> str:
        items = ["efficiency", {"result": "shaft.speed.mean", "error": error}]
        axes = [{"path": X, "adaptive": [0, "1 N*m"], **more}]
        return service.submit({**SPEC, "axes": axes, "refine": {"results": items}, "name": error})

    studies = [asking("60 rpm"), asking("2 %", include=["0.3 N*m"])]
    page = service.http.get("/compare", params={"study": studies, "units": "typed"}).text
    assert "<td>Load torque 0.3 N·m</td>" in page
    cells = "<td>1 %; Mean shaft speed 60 rpm</td><td>1 %; Mean shaft speed 2 %</td>"
    assert f'title="refine.error">Largest error</th>{cells}' in page


def test_inputs_are_named_by_the_model_that_has_them_and_read_as_its_study_typed_them(service: Service) -> None:
    def made(name: str) -> str:
        file, text = preset_text(name)
        return service.submit(load_spec(text, file.rpartition(".")[2]))

    def rows(*studies: str, language: str = "en") -> dict[str, list[str]]:
        text = service.http.get("/compare", params={"study": studies, "units": "typed", "language": language}).text
        found = re.findall(r'<tr><th scope="row"[^>]*>(.*?)</th>(.*?)</tr>', text[text.index('id="inputs"') :])
        return {html.unescape(caption): re.findall("<td>(.*?)</td>", cells) for caption, cells in found}

    drive, press, compressor = made("one_pendulum"), made("press"), made("compressor")
    found = rows(drive, press)
    assert found["Model"] == ["Vibration drive", "Machine shaft"]
    assert found["Inertia of the drive"] == ["–", "13 values from 5 to 80 kg·m², unequal"]
    assert found["Length of the crank"] == ["–", "100 mm"]
    assert found["Beginning of step 1"] == ["–", "120 deg"]
    assert found["Mass"] == ["0.5 kg", "–"]
    assert found["Each case runs"] == ["until its motion is settled", "–"]
    assert found["Excitation frequency"] == ["20 to 35 Hz, 16 values", "–"]
    assert found["Kind of study"] == ["Mean shaft speed along load torque", "Irregularity along inertia of the drive"]
    assert not [caption for caption in found if "." in caption or caption.islower()]
    ukrainian = rows(drive, press, language="uk")
    assert ukrainian["Як задано опір"] == ["–", "сходинки"]
    other = rows(press, compressor)
    assert other["Absolute pressure of suction"] == ["–", "1 bar"]
    assert other["Mean speed"] == ["60; 90; 120; 180 rpm", "750 rpm"]


def test_long_axes_are_ranges_and_written_differently_are_the_same(service: Service) -> None:
    values = [0.01 * (place + 1) for place in range(30)]
    made = submit(service, "long", values)
    other = submit(service, "longer", [*values, 0.31])
    page = service.http.get("/compare", params={"study": [made, other]}).text
    assert "<td>0.01 to 0.3 N·m, 30 values</td><td>0.01 to 0.31 N·m, 31 values</td>" in page
    # Ranges that look the same are told apart.
    bent = submit(service, "bent", [*values[:1], 0.025, *values[2:]])
    page = service.http.get("/compare", params={"study": [made, bent]}).text
    assert "<td>0.01 to 0.3 N·m, 30 values</td><td>30 values from 0.01 to 0.3 N·m, unequal</td>" in page
    spec = {**copy.deepcopy(SPEC), "axes": [{"path": X, "values": ["100 N*mm", "0.2 N*m"]}]}
    same = [service.submit(spec), service.submit({**spec, "axes": [{"path": X, "values": [0.1, 0.2]}]})]
    assert "The inputs of these studies are the same." in service.http.get("/compare", params={"study": same}).text


def test_studies_without_a_common_axis_are_compared_by_their_inputs(service: Service, three: list[str]) -> None:
    other = service.submit({**copy.deepcopy(SPEC), "axes": []})
    page = service.http.get("/compare", params={"study": [three[0], other]})
    assert page.status_code == 200
    assert "no varying parameter in common" in page.text
    page = service.http.get("/compare", params={"study": [three[0], other], "language": "uk"})
    assert "не мають спільного змінного параметра" in page.text
    for part in ("picture.svg", "curves.csv"):
        (fault,) = service.http.get(f"/compare/{part}", params={"study": [three[0], other]}).json()["errors"]
        assert fault["code"] == "nothing-in-common"
    page = service.http.get("/compare", params={"study": [three[0], other]})
    assert '<th scope="row" title="shaft.load">Load torque</th><td>0.1; 0.2; 0.4 N·m</td><td>0.1 N·m</td>' in page.text


def test_others_are_chosen_beside_those_that_are_compared(service: Service, three: list[str]) -> None:
    page = service.http.get("/compare", params={"study": three[:2]}).text
    assert f'href="/compare?choose=1&amp;study={three[0]}&amp;study={three[1]}"' in page
    ticked = [f'value="{study}" checked' for study in three]
    page = service.http.get("/compare", params={"study": [*three[:2], "st_nothing"], "choose": 1}).text
    assert [tick in page for tick in ticked] == [True, True, False]
    assert page.index(ticked[0]) < page.index(ticked[1]) < page.index(f'value="{three[2]}"')
    # A search keeps what is ticked.
    page = service.http.get("/compare", params={"study": three[2], "choose": 1, "search": "best"}).text
    assert page.index(ticked[2]) < page.index(f'value="{three[1]}"')
    assert three[0] not in page


def test_the_table_has_every_point_of_every_study(service: Service, three: list[str]) -> None:
    found = rows(service, three, by="excitation.frequency")
    assert [row["study"] for row in found] == ["first"] * 6 + ["second & best"] * 8 + ["third"] * 6
    expected = [y for study in three for text in ("20 Hz", "22 Hz") for y in curve(service, study, text)[1]]
    got = [float(row[Y]) if row[Y] else np.nan for row in found]
    np.testing.assert_array_equal(got, expected)


def test_differences_are_those_of_numpy_at_known_and_interpolated_places(service: Service, three: list[str]) -> None:
    at = {"at": "excitation.frequency=22 Hz"}
    found = rows(service, three[:2], less=three[0], **at)
    assert {row["study"] for row in found} == {"second & best − first"}
    x, y = curve(service, three[0], "22 Hz")
    other_x, other_y = curve(service, three[1], "22 Hz")
    expected = np.array(other_y) - np.interp(other_x, x, y, left=np.nan, right=np.nan)
    got = np.array([float(row[Y]) if row[Y] else np.nan for row in found])
    assert np.isnan(got[-1])  # 0.9 N*m is beyond the reference
    np.testing.assert_allclose(got, expected, rtol=1e-12)
    family = rows(service, [three[0], three[2]], by="excitation.frequency", less=three[2])
    assert [float(row["excitation.frequency"]) for row in family] == [20.0] * 3 + [22.0] * 3
    first = [y for text in ("20 Hz", "22 Hz") for y in curve(service, three[0], text)[1]]
    third = [y for text in ("20 Hz", "22 Hz") for y in curve(service, three[2], text)[1]]
    got = np.array([float(row[Y]) if row[Y] else np.nan for row in family])
    np.testing.assert_allclose(got, np.array(first) - np.array(third), rtol=1e-12)


def test_pages_figures_and_pictures_show_differences(service: Service, three: list[str]) -> None:
    query = {"study": three, "x": X, "y": Y, "less": three[0]}
    text = service.http.get("/compare", params=query).text
    assert "Differences from mass 0.5 kg, whose curves are interpolated" in text
    assert f'<option value="{three[0]}" selected>differences from mass 0.5 kg' in text
    (panel,) = seen(service.http.get("/compare", params=query).text).panels
    assert {curve.name for curve in panel.curves} == {"0.6 kg − 0.5 kg", "0.7 kg − 0.5 kg"}
    for form, start in (("svg", b"<?xml"), ("png", b"\x89PNG"), ("pdf", b"%PDF")):
        answer = service.http.get(f"/compare/picture.{form}", params=query)
        assert (answer.status_code, answer.content[: len(start)]) == (200, start), form


def numbers_of(text: str) -> dict[str, list[str]]:
    """The cells of the table of numbers by the titles of its rows, without markup."""
    table = text[text.index('id="numbers"') :].partition("</table>")[0]
    rows = re.findall(r"<tr><th scope=\"row\">(.*?)</th>(.*?)</tr>", table, re.DOTALL)
    plain = lambda cell: html.unescape(re.sub(r"<[^>]+>", "|", cell)).strip("|")  # noqa: E731
    return {plain(title): [plain(cell) for cell in re.findall("<td.*?>(.*?)</td>", cells)] for title, cells in rows}


def test_the_answer_comes_first(service: Service, three: list[str]) -> None:
    text = service.http.get("/compare", params={"study": three, "units": "si"}).text
    said = re.search(r'<p class="say[^>]*>(.*?)</p>', text)
    assert said is not None
    masses = ("0.5 kg", "0.6 kg", "0.7 kg")
    speeds = {mass: curve(service, study, "22 Hz")[1][0] for mass, study in zip(masses, three, strict=True)}
    largest, smallest = (
        ", ".join(f"“mass {mass}”" for mass, speed in speeds.items() if speed == end)
        for end in (max(speeds.values()), min(speeds.values()))
    )
    assert said[1].startswith("At 0.1 N·m the mean shaft speed is largest, ")
    assert said[1].index(f"with {largest}, and smallest, ") < said[1].index(f"with {smallest}.")
    parts = ('id="say"', 'id="numbers"', 'id="chart"', 'aria-label="What is drawn"')
    assert sorted(parts, key=text.index) == list(parts)
    rows = numbers_of(text)
    told = [f"{number(value, 3)} rad/s" for value in speeds.values()]
    assert rows["Mean shaft speed|at 0.1 N·m"] == told
    # The model says of power and efficiency what is better, of speeds it does not.
    best = {title: [cell.count("best") for cell in cells] for title, cells in rows.items()}
    power = next(title for title in rows if title.startswith("Largest useful power"))
    assert 0 < sum(best[power]) < 3
    assert not any(sum(cells) for title, cells in best.items() if "speed" in title)
    ukrainian = service.http.get("/compare", params={"study": three, "language": "uk"}).text
    assert "найбільше значення" in ukrainian


def test_a_chart_has_five_curves_and_says_what_it_leaves_out(service: Service) -> None:
    masses = [f"0.{mass} kg" for mass in range(3, 9)]
    six = [submit(service, f"mass {mass}", [0.1, 0.2], mass) for mass in masses]
    query: dict[str, Any] = {"study": six, "x": X, "units": "si"}

    def drawn(**further: Any) -> tuple[list[str], str]:
        text = service.http.get("/compare", params={**query, **further}).text
        picture = seen(service.http.get("/compare/picture.svg", params={**query, **further}).text)
        names = [curve.name for curve in seen(text).panels[0].curves]
        assert [curve.name for curve in picture.panels[0].curves] == names
        return names, text

    names, text = drawn()
    assert names == masses[:5]
    assert "A chart has at most 5 curves. Without one here: “0.8 kg”. Choose others under “Other curves”." in text
    names, text = drawn(show=six[2:])
    assert names == masses[2:]
    assert "at most 5 curves." not in text
    assert f'name="show" value="{six[5]}" checked' in text
    assert f'name="show" value="{six[0]}" checked' not in text
    family = {"by": "excitation.frequency", "show": six[:4]}
    names, text = drawn(**family)
    assert names == ["20"] * 4
    assert "Without one here: excitation frequency = 22 Hz." in text
    names, _ = drawn(**family, of="excitation.frequency=22 Hz")
    assert names == ["22"] * 4
    assert len(rows(service, six)) == 12


def test_studies_of_different_models_or_kinds_are_told_apart(service: Service, three: list[str]) -> None:
    file, text = preset_text("press")
    press = service.submit(load_spec(text, file.rpartition(".")[2]))
    page = service.http.get("/compare", params={"study": [three[0], press]})
    assert page.status_code == 200
    assert "These studies are of different models (Vibration drive, Machine shaft)" in page.text
    assert 'id="numbers"' not in page.text
    assert 'role="alert"' not in page.text
    refused = service.http.get("/compare/curves.csv", params={"study": [three[0], press]})
    assert refused.status_code == 422
    assert "of different models" in refused.text
    batch = copy.deepcopy(SPEC)
    batch |= {"axes": [{"path": X, "values": [0.1, 0.2]}], "drives": 4,
              "tolerances": [{"path": "pendulums.0.mass", "plus_minus": "5 %"}]}  # fmt: skip
    batched = service.submit({**batch, "name": "batch"})
    service.fill(batched)
    text = service.http.get("/compare", params={"study": [three[0], batched]}).text
    assert "These studies ask different things" in text
    assert "Median of the drives" in numbers_of(text)
    assert "<td>0.5 kg</td><td>0.5 kg ± 5 %, normal</td>" in text
    assert "<td>Mean shaft speed along load torque</td><td>What tolerances do</td>" in text


def test_what_cannot_be_compared_is_refused(service: Service, three: list[str]) -> None:
    for query in ({"study": three, "less": "st_nothing"}, {"study": three[:1], "less": three[0]}):
        page = service.http.get("/compare", params=query)
        assert page.status_code == 422
        assert "is none of the compared studies" in page.text
    many = [submit(service, f"number {count}", [0.1, 0.2]) for count in range(MOST_COMPARED + 1)]
    assert service.http.get("/compare", params={"study": many[:MOST_COMPARED]}).status_code == 200
    page = service.http.get("/compare", params={"study": many})
    assert page.status_code == 422
    assert "at most 10" in page.text
    assert service.http.get("/compare/picture.gif", params={"study": three}).status_code == 422
    for part in ("curves.csv", "picture.svg"):
        (fault,) = service.http.get(f"/compare/{part}").json()["errors"]
        assert (fault["parameter"], fault["code"], fault["allowed"]) == ("study", "required", "1 to 10 ids of studies")
    assert service.http.get("/compare/curves.csv", params={"study": [*three, "st_nothing"]}).status_code == 404


def test_what_varies_in_all_studies() -> None:
    drives, load = (("drive",), 9), (("shaft.load", "a"), 3)
    assert common_axes([[load, drives, (("b",), 2)], [(("c", "shaft.load"), 2), drives, (("b",), 1)]]) == [X]
    assert common_axes([[drives], [drives]]) == []
    assert NO_PARAMETERS == models.NO_PARAMETERS
    assert common_axes([[load, (("clutch",), 3)], [load, (("clutch",), 3)]]) == [X]  # other clutches in each
    assert set(KINDS) == COMPONENTS


def test_names_of_studies_tell_them_apart() -> None:
    assert unique_names(["a", "b", "a", ""], ["st_1", "st_2", "st_3", "st_4"]) == ["a (st_1)", "b", "a (st_3)", "st_4"]
