"""Units and captions: every painter shows one number in one unit, that of a conversion by hand."""

from __future__ import annotations

import io
import math
import pickle
import re
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest

from sprag_study.sentences import Amount, Name
from sprag_study.service.exports import read_table
from sprag_study.service.faults import SelectionError
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.pictures import draw_figure
from sprag_study.service.figures.read import read_figure, read_map
from sprag_study.service.figures.svg_map import picture_map
from sprag_study.service.http.views import preset_of
from sprag_study.service.reading.quantities import KINDS, UNITS_PATTERN, Units, read_units, typed_units, units_for
from sprag_study.service.reading.reader import CODES, Choice, Phrase, Reading, reading_for
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.reading.wording import unit_text
from sprag_study.service.results.curve_cases import draw, draw_map, select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.storage.studies.records import CaseColumns
from sprag_study.worker import models
from sprag_study.worker.models.vocabulary import caption
from tests.service.figures.seen import seen
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study
    from tests.service.conftest import Service

#: Each unit in SI, by hand.
BY_HAND = {
    "deg": math.pi / 180.0, "rpm": 2.0 * math.pi / 60.0, "deg/s": math.pi / 180.0, "deg/s^2": math.pi / 180.0,
    "ms": 1e-3, "min": 60.0, "mm": 1e-3, "cm": 1e-2, "in": 0.0254, "mm/s": 1e-3, "mm/s^2": 1e-3, "g0": 9.80665,
    "mm^2": 1e-6, "cm^2": 1e-4, "g": 1e-3, "t": 1e3, "lb": 0.45359237, "g/cm^3": 1e3, "kg*cm^2": 1e-4,
    "kg*mm^2": 1e-6, "g*cm^2": 1e-7, "kN": 1e3, "lbf": 4.4482216152605, "N*mm": 1e-3, "N*cm": 1e-2, "kN*m": 1e3,
    "lbf*ft": 1.3558179483314, "lbf*in": 0.11298482902762, "mJ": 1e-3, "kJ": 1e3, "mW": 1e-3, "kW": 1e3, "kPa": 1e3,
    "hp": 745.6998715822702, "PS": 735.49875,
    "MPa": 1e6, "bar": 1e5, "N/mm": 1e3, "kN/m": 1e3, "N*mm*s/rad": 1e-3, "%": 1e-2,
}  # fmt: skip
LOADS = [0.0, 0.2, 0.4]
AXES = [
    {"path": "shaft.load", "values": LOADS},
    {"path": "excitation.frequency", "values": ["1200 rpm", "1500 rpm"]},
]
SPEED = "shaft.speed.mean"
CHOICE = Choice("speed=rpm,torque=N*mm,frequency=rpm,power=mW")


def study_of() -> tuple[Study, dict[str, Any]]:
    spec = changed({"/axes": AXES})
    return parse_spec(spec).study, spec


def fetch(cases: NDArray[np.int64], names: Sequence[str]) -> CaseColumns:
    """Speeds of 10 rad/s and more."""
    values = {name: 10.0 + cases.astype(np.float64) for name in names}
    return CaseColumns(cases, ["ok"] * cases.size, values, [""] * cases.size)


def reading(choice: Choice = CHOICE) -> Reading:
    return reading_for(*study_of(), choice)


def test_every_offered_unit_is_that_of_a_conversion_by_hand() -> None:
    for kind in KINDS:
        assert Units().value(3.0, kind.unit) == 3.0
        for unit in kind.others:
            one = 1.0 / 60.0 if (kind.name, unit) == ("frequency", "rpm") else BY_HAND[unit]
            units = Units({kind.unit: unit})
            assert units.unit(kind.unit) == unit
            assert units.value(3.0, kind.unit) == pytest.approx(3.0 / one, rel=1e-13)
            assert units.values(np.array([3.0]), kind.unit)[0] == units.value(3.0, kind.unit)


def test_picture_and_table_show_one_number_in_one_unit() -> None:
    study, spec = study_of()
    curves = draw(select(study, CurveQuery("shaft.load", (SPEED,), ("excitation.frequency",))), fetch)
    read = reading_for(study, spec, CHOICE)
    figure = read_figure(curves_figure([("", curves)]), read)
    wanted = [(10.0 + case) * 60.0 / (2.0 * math.pi) for case in (0, 2, 4)]
    line = next(line for line in figure.panels[0].lines if line.name == "1200")
    np.testing.assert_allclose(line.y, wanted, rtol=1e-13)
    np.testing.assert_allclose(line.x, [1e3 * load for load in LOADS], rtol=1e-13)
    picture = seen(draw_figure(figure, "", "svg"))
    drawn = next(curve for curve in picture.panels[0].curves if curve.name == "1200")
    np.testing.assert_allclose(drawn.values[:, 1], wanted, rtol=1e-2)
    assert picture.has("Load torque (N·mm)", "Mean shaft speed (rpm)")
    table = read_table(
        {"shaft.load": LOADS, SPEED: [10.0, 12.0, None]}, {"shaft.load": "N*m", SPEED: "rad/s"}, read.units
    ).decode()
    head, first, *_, last = table.splitlines()
    assert head == "shaft.load [N*mm],shaft.speed.mean [rpm]"
    assert [float(cell) for cell in first.split(",")] == pytest.approx([0.0, wanted[0]], rel=1e-13)
    assert last == "400.0,"


@pytest.mark.parametrize("form", ["csv", "parquet", "xlsx"])
def test_files_of_all_rows_have_the_chosen_units(service: Service, form: str) -> None:
    study_id = service.submit()
    rows = service.fill(study_id)
    names = [info.name for info in models.study_results(service.store.studies.study(study_id))]
    wanted = rows.values[:, names.index(SPEED)] * 30.0 / math.pi
    path = f"/api/v1/studies/{study_id}/results"
    answer = service.http.get(path, params={"format": form, "units": "rpm,torque=N*mm"})
    loads = service.store.studies.study(study_id).columns(range(9))["shaft.load"]
    if form == "csv":
        table = pd.read_csv(io.BytesIO(answer.content))
        speed, load = f"{SPEED} [rpm]", "shaft.load [N*mm]"
    elif form == "parquet":
        table = pd.read_parquet(io.BytesIO(answer.content))
        speed, load = SPEED, "shaft.load"
        field = pq.read_schema(io.BytesIO(answer.content)).field(SPEED)
        assert field.metadata[b"unit"] == b"rpm"
    else:
        table = pd.read_excel(io.BytesIO(answer.content), header=1)
        speed, load = SPEED, "shaft.load"
        units = dict(zip(table, pd.read_excel(io.BytesIO(answer.content), header=None, nrows=1).iloc[0], strict=True))
        assert (units[SPEED], units["shaft.load"]) == ("rpm", "N*mm")
    np.testing.assert_allclose(table[speed], wanted, rtol=1e-13)
    np.testing.assert_allclose(table[load], loads * 1e3, rtol=1e-13)
    refused = service.http.get(path, params={"format": "netcdf", "units": "rpm"})
    assert refused.json()["errors"][0]["code"] == "not-used"


def test_a_map_has_the_units_of_curves() -> None:
    study, spec = study_of()
    drawn = draw_map(study, "shaft.load", "excitation.frequency", SPEED, (), fetch)
    read = read_map(drawn, reading_for(study, spec, CHOICE))
    np.testing.assert_allclose(read.y_values, [1200.0, 1500.0], rtol=1e-13)
    np.testing.assert_allclose(read.values[0][0], 10.0 * 30.0 / math.pi, rtol=1e-13)
    assert seen(picture_map(read, "")).has("Excitation frequency (rpm)", "Mean shaft speed (rpm)")


def test_units_are_as_typed_unless_others_are_chosen() -> None:
    study, spec = study_of()
    typed = typed_units(study, spec)
    assert (typed["Hz"], typed["m"]) == ("rpm", "mm")
    assert units_for(study, spec, "si").chosen == {}
    assert units_for(study, spec, "typed").unit("Hz") == "rpm"
    mixed = units_for(study, spec, "typed, frequency=Hz, speed=rpm")
    assert (mixed.unit("Hz"), mixed.unit("rad/s"), mixed.unit("m")) == ("Hz", "rpm", "mm")


def test_coefficients_of_a_torque_have_its_unit() -> None:
    units = Units({"N*m": "N*mm"})
    assert [units.unit(si) for si in ("N*m", "N*m/rad", "N*m/rad^3", "N*m*s/rad")] == [
        "N*mm", "N*mm/rad", "N*mm/rad^3", "N*m*s/rad"
    ]  # fmt: skip
    assert units.value(2.5, "N*m/rad^3") == pytest.approx(2500.0)
    assert Units().unit("N*m/rad") == "N*m/rad"


def test_a_bare_unit_is_of_the_first_kind_that_has_it() -> None:
    assert read_units("rpm, mm, N·mm") == ("si", {"rad/s": "rpm", "m": "mm", "N*m": "N*mm"})
    assert read_units("typed") == ("typed", {})
    assert read_units("N*mm, workshop") == ("workshop", {"N*m": "N*mm"})
    assert read_units(reading().units.text) == ("si", {"rad/s": "rpm", "N*m": "N*mm", "Hz": "rpm", "W": "mW"})


def test_a_workshop_reads_shares_in_per_cent_and_no_other_number_without_a_unit() -> None:
    workshop = reading(Choice("workshop"))
    share, speed = (
        next(info for info in models.study_results(study_of()[0]) if info.name == name)
        for name in ("efficiency", SPEED)
    )
    assert share.unit == "1"
    assert workshop.quantity(0.8113, share.unit, 3) == "81.1 %"
    assert workshop.typed("81", share.unit) == "81 %"
    assert parse_quantity("81,1 %", share.unit) == 0.811
    assert workshop.quantity(0.8113, "1", 3) == "0.811"
    assert workshop.quantity(math.pi, speed.unit, 3) == "30 rpm"
    assert reading(Choice("si")).quantity(0.8113, share.unit, 3) == "0.811"
    assert reading(Choice("workshop,N*mm")).quantity(0.3, "N*m", 3) == "300 N·mm"


@pytest.mark.parametrize("text", ["furlong", "speed=mm", "pace=rpm", "rpm;mm", "x" * 500])
def test_unknown_units_are_refused(text: str) -> None:
    with pytest.raises(SelectionError) as caught:
        read_units(text)
    (fault,) = caught.value.faults
    assert (fault.where, bool(fault.allowed)) == ("units", True)
    assert not re.search(UNITS_PATTERN, text)


def test_the_documented_pattern_has_every_offered_choice() -> None:
    units = [unit for kind in KINDS for unit in (kind.unit, *kind.others)]
    pairs = [f"{kind.name}={unit}" for kind in KINDS for unit in (kind.unit, *kind.others)]
    for text in ("", "si", "typed", "typed,rpm", *units, *pairs, ",".join(pairs[:12])):
        read_units(text)
        assert re.search(UNITS_PATTERN, text), text


def test_phrases_are_said_in_the_words_and_units_of_the_reader() -> None:
    load, power = Amount(0.2, "N*m"), Phrase("{value}", value=Amount(1.0, "W"))
    phrase = Phrase("At {name} = {load}, {power}", name=Name("shaft.load", within=True), load=load, power=power)
    assert phrase == "At shaft.load = 0.2 N·m, 1 W"
    assert phrase.said(reading()) == "At load torque = 200 N·mm, 1000 mW"
    assert pickle.loads(pickle.dumps(phrase)).said(reading()) == phrase.said(reading())
    assert phrase.said(reading(Choice("si", CODES))) == phrase


def test_a_zero_does_not_choose_the_unit_of_its_kind() -> None:
    spec = preset_of("one_pendulum")["spec"]  # a phase of 0 deg beside a backlash of 0.005 rad
    study = parse_spec(spec).study
    assert typed_units(study, spec)["rad"] == "rad"
    spec["base"]["pendulums"][0]["backlash"] = 0.005
    assert typed_units(study, spec)["rad"] == "deg"


def test_a_bare_number_that_is_typed_beside_a_unit_has_it() -> None:
    assert reading().typed("300", "N*m") == "300 N*mm"
    assert reading().typed("0.3 N*m", "N*m") == "0.3 N*m"
    assert Reading("vibration-drive").typed("300", "N*m") == "300"


def test_every_parameter_and_result_has_a_caption_of_its_own() -> None:
    for model in models.model_names():
        names = [entry.path for entry in models.parameter_catalogue(model)]
        names += [info.name for info in models.result_catalogue(model)]
        names = [name.replace(".N", ".0").replace(".K", ".0") for name in names if "NAME" not in name]
        captions = {name: caption(model, name) for name in names}
        for name, text in captions.items():
            assert not set("._") & set(text), (name, text)
            assert text[0].isupper(), (name, text)
        results = [info.name.replace(".N", ".0").replace(".K", ".0") for info in models.result_catalogue(model)]
        assert len(results) == len({captions[name] for name in results})


def test_texts_for_units_can_be_typeset() -> None:
    assert {unit_text(unit) for kind in KINDS for unit in kind.others} >= {"N·mm", "kg·cm²", "deg/s²"}
