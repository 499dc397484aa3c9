"""The efficiency of a machine shaft as share of the work of a cycle: specs, the form, and what is told of it."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import pytest

from sprag_study.service.exports.inputs import inputs
from sprag_study.service.http.web.form.page import empty
from sprag_study.service.http.web.form.spec import spec_of, values_of
from sprag_study.service.presets import preset_text
from sprag_study.service.results.shown_inputs import in_words
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.spec.report import SpecError
from sprag_study.worker import models
from tests.service.spec.machine.test_shaft import PRESS

NAME, TEXT = preset_text("compressor")
COMPRESSOR: dict[str, Any] = load_spec(TEXT, NAME.rpartition(".")[2])


def compressor(**operation: Any) -> dict[str, Any]:
    spec = {**deepcopy(COMPRESSOR), "axes": []}
    spec["base"]["operation"] |= operation
    return spec


def work(spec: dict[str, Any]) -> float:
    study = parse_spec(spec).study
    names = [info.name for info in models.study_results(study)]
    return float(models.run_chunk(study, 0, 1).values[0, names.index("work.resistance")])


def test_it_is_a_word_that_specs_of_before_do_not_have() -> None:
    plain, by_power = compressor(), compressor(efficiency_is="power")
    assert parse_spec(by_power).study == parse_spec(plain).study
    assert "efficiency_is" not in (parse_spec(plain).study.structure or {})["operation"]
    free = work(plain)
    assert work(compressor(efficiency=0.8, efficiency_is="work")) == pytest.approx(free / 0.8, rel=1e-11)
    assert work(compressor(efficiency=0.8)) < 1.01 * free / 0.8


def test_a_formula_has_none_and_other_words_are_refused() -> None:
    press = {**deepcopy(PRESS), "axes": []}
    press["base"]["operation"] = {"quantity": "torque", "formula": "3 + sin(phi)", "efficiency_is": "work"}
    for spec, words in (
        (press, "is not possible for a formula"), (compressor(efficiency_is="net"), "is not a valid choice"),
    ):  # fmt: skip
        with pytest.raises(SpecError) as refused:
            parse_spec(spec)
        assert "/base/operation/efficiency_is: " in str(refused.value)
        assert words in str(refused.value)


def test_the_form_and_the_inputs_say_it() -> None:
    given = compressor(efficiency=0.8, efficiency_is="work")
    made, faults = spec_of({**empty("machine-shaft"), **values_of(given)})
    assert not faults
    assert made["base"]["operation"]["efficiency_is"] == "work"
    study = parse_spec(given).study
    (item,) = (each for each in inputs(study, given) if each.path == "operation.efficiency_is")
    assert in_words(item) == "share of the work of a cycle"
