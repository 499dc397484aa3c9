"""What was given, varied and searched, as a document and the page of a study print it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service import languages
from sprag_study.service.reading.reader import Choice, Reading
from sprag_study.service.report.blocks import Document, Table, Text
from sprag_study.service.report.document import document_of
from sprag_study.service.results.shown_inputs import inputs, varying
from sprag_study.service.results.varied import listed, tolerances_of
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import ReportQuestion
from tests.service.http.web.test_accessibility import preset
from tests.service.report.test_two_pages import finished
from tests.service.searching import search

if TYPE_CHECKING:
    from tests.service.conftest import Service

FORMULA = "1.1 * pendulums.0.mass * pendulums.0.arm^2 + 5e-4 kg*m^2 - 2 g*mm^2"
PRINTED = "1.1 · (mass) · (arm of the mass)² + 0.0005 kg·m² − 2 g·mm²"


def rows(document: Document) -> list[tuple[str, ...]]:
    """The rows of all tables of a document."""
    return [
        tuple(map(str, row))
        for section in document.sections
        for block in section.blocks
        if isinstance(block, Table)
        for row in block.rows
    ]


def document(service: Service, study_id: str, **question: Any) -> Document:
    """The document of a study in the units of a workshop."""
    return document_of(Library(service.store), study_id, Choice("workshop"), ReportQuestion(**question))


def derived(service: Service, spec: dict[str, Any]) -> str:
    """A study of which an inertia is a formula."""
    del spec["base"]["pendulums"][0]["inertia"]
    return service.submit(spec | {"derive": {"pendulums.0.inertia": FORMULA}})


def test_a_formula_keeps_the_units_it_was_written_with(service: Service, spec: dict[str, Any]) -> None:
    study_id = derived(service, spec)
    service.fill(study_id)
    found = rows(document(service, study_id, appendix=["inputs", "given"]))
    assert [row[1:] for row in found if row[0] == "Inertia"] == [
        (f"= {PRINTED}",), (PRINTED, "", "derived"), (PRINTED,)
    ]  # fmt: skip
    study = service.store.studies.study(study_id)
    written, reading = service.store.studies.spec(study_id), Reading(study.model, single=frozenset({"pendulum"}))
    (item,) = (row["item"] for _, part in inputs(study, written, reading) for row in part if row["item"].formula)
    assert (item.value, item.unit) == (PRINTED, "")
    assert varying(study, written, reading)[1] == [("pendulums.0.inertia", PRINTED)]
    coded = Reading(study.model, names="codes")
    assert varying(study, written, coded)[1] == [("pendulums.0.inertia", FORMULA)]
    page = service.http.get(f"/studies/{study_id}?units=workshop").text
    assert page.count(PRINTED) == 2
    assert "0.0005</" not in page


@pytest.mark.parametrize(
    ("values", "printed", "count"),
    [
        (["0 N*m", "0.1 N*m", "0.2 N*m", "0.4 N*m"], "0; 0.1; 0.2; 0.4 N·m", "0; 0.1; 0.2; 0.4"),
        (["0 N*m", "0.1 N*m", "0.2 N*m", "0.3 N*m"], "0 to 0.3 N·m, 4 values", "4"),
        ([f"{n * n} N*mm" for n in range(1, 11)], "10 values from 0.001 to 0.1 N·m, unequal", "10, unequal"),
    ],
)
def test_only_evenly_divided_values_are_told_as_a_range(
    service: Service, spec: dict[str, Any], values: list[str], printed: str, count: str
) -> None:
    study_id = service.submit(spec | {"axes": [{"path": "shaft.load", "values": values}]})
    service.fill(study_id)
    found = [row[1] for row in rows(document(service, study_id, appendix=["axes"])) if row[0] == "Load torque"]
    assert found == [printed, count]
    assert f'<td class="num">{count}</td>' in service.http.get(f"/studies/{study_id}").text


def test_a_catalogue_of_a_search_is_its_values() -> None:
    text = listed((0.001, 0.002, 0.01), "kg*m^2")
    with languages.language("uk"):
        assert Reading("vibration-drive").say(text) == "0,001; 0,002; 0,01 кг·м²"


def test_a_search_tells_what_it_was_asked_for_and_all_of_the_best_design(service: Service) -> None:
    told = document(service, search(service))
    found = dict(row[:2] for row in rows(told))
    assert found["Goals"] == "Largest efficiency; Smallest irregularity"
    assert found["Limits"].startswith("Mean shaft speed = ")
    assert found["Inertia of the driven side"] == "10; 20 kg·cm², searched"
    first = {str(row[0]) for block in told.sections[0].blocks if isinstance(block, Table) for row in block.rows}
    assert {"Efficiency", "Excitation frequency", "Horizontal amplitude", "Inertia of the driven side"} <= first


def test_a_batch_is_answered_where_every_drive_has_a_case(service: Service) -> None:
    """Neither of 0.05 and 0.15 N·m is the load of the base, 0.1 N·m; widths and the nominal drive are named."""
    study_id = finished(service, "tolerances")
    told = document(service, study_id, appendix=["answers", "given"])
    found = rows(told)
    assert not [row for row in found if "interpolated" in row[-1]]
    (share,) = (row for row in found if row[0] == "Yield")
    assert share[-1].endswith("of nominal, at 0.15 N·m")
    given = {row[0]: row[1] for row in found}
    assert given["Spring rate"] == "9000 N/m"
    assert given["Tolerance: spring rate"] == "± 10 %, uniform"
    assert given["Tolerance: horizontal amplitude = vertical amplitude"] == "± 5 %, normal"
    assert given["Clutch, coefficients"] == "0; 200; 0; 20\u202f000"
    assert ("Spring rate", "9 N/mm ± 10 %, uniform") in found
    (along,) = (section for section in told.sections if section.title.startswith("Answers along"))
    assert [block.text for block in along.blocks if isinstance(block, Text)] == ["Nominal drive"]
    assert "±</text>" not in service.http.get(f"/studies/{study_id}").text


def test_a_tolerance_is_read_as_it_is_printed(service: Service) -> None:
    spec = {**preset("tolerances"), "tolerances": [{"path": "shaft.inertia", "plus_minus": "± 5 %"}]}
    study = service.store.studies.study(service.submit(spec))
    assert [str(text) for _, text in tolerances_of(study)] == ["± 5 %, normal"]


def test_the_first_page_tells_which_curve_its_numbers_are_of(service: Service) -> None:
    study_id = finished(service, "one_pendulum")
    with languages.language("uk"):
        first = document(service, study_id).sections[0].blocks
    assert [block.text for block in first if isinstance(block, Text)][1:] == [
        "Горизонтальна амплітуда = вертикальна амплітуда = 2 мм; Частота збудження = 25 Гц"
    ]


def test_what_pendulums_have_in_common_is_one_condition(service: Service, spec: dict[str, Any]) -> None:
    first = spec["base"]["pendulums"][0]
    spec["base"]["pendulums"].append(first | {"spring_rate": "18 N/mm"})
    study_id = service.submit(spec)
    service.fill(study_id)
    told = document(service, study_id, appendix=["inputs"])
    (part,) = (section for section in told.sections if section.title == "Conditions")
    found = {str(row[0]): str(row[1]) for table in part.blocks if isinstance(table, Table) for row in table.rows}
    assert found["Mass, every pendulum"] == "0.5 kg"
    assert (found["Spring rate, pendulum 1"], found["Spring rate, pendulum 2"]) == ("9 N/mm", "18 N/mm")
    assert not {"Mass, pendulum 1", "Mass, pendulum 2", "Spring rate, every pendulum"} & set(found)
    common = sum("every pendulum" in caption for caption in found)
    (rest,) = (str(block.text) for block in part.blocks if isinstance(block, Text))
    (appendix,) = (section for section in told.sections if section.title == "Inputs")
    every = [row for table in appendix.blocks if isinstance(table, Table) for row in table.rows]
    inputs_of_machine = [row for row in every if not str(row[0]).startswith("Run:")]
    assert int(rest.split()[0]) == len(inputs_of_machine) - len(found) - common
