"""Warnings speak captions and the reader's units to people, on pages and in reports; programs have JSON Pointers."""

from __future__ import annotations

import copy
import html
import re
from typing import TYPE_CHECKING, Any, get_args

import pytest

from sprag_study.sentences import WarningText
from sprag_study.service.faults import WarningCode
from sprag_study.service.http.views import preset_of
from sprag_study.service.languages import language
from sprag_study.service.reading.quantities import WORKSHOP
from sprag_study.service.reading.reader import Choice
from sprag_study.service.report.blocks import Text
from sprag_study.service.report.document import document_of
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.views.library import Library
from sprag_study.service.views.study_questions import ReportQuestion
from tests.service import warning_samples
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from tests.service.conftest import Service

#: A sentence of each code, as earlier versions stored it, about places of every part of a spec.
DRIVE: dict[WarningCode, str] = {
    "added-vibration": "/base/excitation/amplitude_y: is added to the measured motion",
    "ambiguous-point": "/points: line 3: `20.000` is taken as 20, with a decimal point",
    "angular-frequency": "/derive (excitation.frequency): a root of this kind is an angular frequency in rad/s",
    "assumed-units": "/base/clutch/data: the file does not name every unit: angles are taken in rad",
    "exceeds-chunk-timeout": "One case takes about 70 s, and 60 s are allowed (SPRAG_CHUNK_TIMEOUT)",
    "falls-over": "/base/pendulums/0: c a^2 < M g l: the spring's 0.5 N*m/rad do not hold the pendulum up against "
    "gravity's 2 N*m/rad; without vibration it falls to one side (in 3 of 12 cases)",
    "implausible-value": "/axes/0 (excitation.amplitude_x): 1.6 m is more than 0.1 m; was it in mm?",
    "impossible-inertia": "/base/pendulums/0: J < M l^2: an inertia of 1e-05 kg*m^2 about the axis is less than the "
    "0.0004 kg*m^2 of the mass at its arm alone, which no rigid body has",
    "invalid-drives": "/derive (pendulums.0.inertia): is out of its range (> 0 kg*m^2) in 3 of 12 cases: these drives "
    "fail",
    "late": "By estimate it will not be finished by then: it needs about 2 h and 1 h are left",
    "law-ends-falling": "/base/pendulums/0/clutch: the slope at the end of the range (u = 0.5 rad) is -20 N*m/rad",
    "law-falls": "/base/clutch: the law is not monotone: its torque falls with growing windup",
    "law-jumps": "/axes/1 (clutch.coefficients.0): c_1 = 0.2 N*m > 0: the torque jumps to c_1",
    "many-runs": "/starts/count: 40,000 cases with 32 starts each are 1,280,000 runs",
    "mixed-origins": "The cases of this study were not all computed by one version of Sprag and its libraries",
    "no-effect": "/axes/0 (excitation.amplitude_x = excitation.amplitude_y): was varied, but changes no result",
    "not-monotonic": "/axes/0/values (shaft.load): the values rise at first, but 0.2 N*m stands after 100 N*m",
    "nothing-moves": "/base/excitation: both amplitudes are 0, so the base does not move",
    "reduced-motion": "/base/excitation/measured: 2 harmonics stand for the measured motion",
    "rows-in-backlash": "/base/clutch: 2 of 9 rows lie within the backlash and were left out of the fit",
    "short-search": "/run/at_most: 100 periods are too few for the means of irregular motion, which takes 400",
    "short-window": "/run/window: shorter than one excitation period at 25 Hz (0.5 periods)",
    "slow-excitation": "/base/excitation/frequency: below 0.1 Hz, which is slow for a vibration drive",
    "stays-upright": "/base/pendulums: with vibration along y alone a pendulum that starts upright stays upright",
    "terms-cancel": "/base/clutch: the terms of the law of degree 5 are together 40 times as large as the torque",
    "tolerance-cut": "/tolerances/0 (pendulums.0.mass): 0.02 of the distribution lies outside the range",
    "too-few-rows": "/base/clutch: degree 4 has as many unknowns as the data has different windups",
    "wide-limit": "/goal/subject_to/0/within (shaft.speed.mean): is at least as wide as the value",
}
SHAFT: dict[WarningCode, str] = {
    "near-resonance": "/base/drive/stages: harmonic 3 of the cycle, 30 rad/s, is within 2 % of a torsional natural",
    "never-acts": "/axes/0 (operation.steps.0.from): where `from` exceeds `to` the step over the stroke never acts",
    "no-compression": "/base/operation/gas/discharge_pressure: is below the suction pressure: nothing is compressed",
    "no-discharge": "/axes/0 (operation.gas.discharge_pressure): the compressor reaches 300000 Pa at most",
    "no-such-angle": "/base/phi_c: 3 is out of range: the machine of base has 2 angles with T = T_mean",
    "nothing-acts": "/base/parts/1: has neither a mechanism nor an operation, so it does nothing",
    "replaced-value": '/base/parts/0/operation: is not used: the balance "constant" replaces it',
    "several-speeds": "/base: the torques of this machine balance at about 19.01 rad/s too",
    "table-ends-early": "/base/drive/torque: the table ends at 180 deg, 180 deg before its cycle of 360 deg",
    "torque-reverses": "/base/drive/stages: the torque of 1 coupling changes its sign within the cycle",
    "unstable-motion": "/base: the steady motion of the machine is unstable",
    "wraps-around": "/axes/0 (operation.steps.0.to): where `from` exceeds `to` the step continues",
    "no-effect": "/base/operation/sense: is not used: a positive torque always resists; `sense` is for forces",
    "implausible-value": "/base/mean_speed: 3000 rad/s is more than 1000 rad/s; was it in rpm?",
}
#: The units of a page that nobody has chosen others for.
PAGE = Choice(WORKSHOP)
POINTER = re.compile(r"/(?:axes|base|derive|goal|points|run|starts|tolerances)\b")
#: Names of the spec; letters of formulas such as c_1 and T_mean, and the name of a setting, are none.
CODE = re.compile(r"(?<![\w.])(?!c_\d|T_mean)[a-z]+(?:\.\d+)?[._][a-z]\w*")


def test_every_code_has_a_sentence() -> None:
    assert {*DRIVE, *SHAFT} == set(get_args(WarningCode))


def warned(service: Service, spec: dict[str, Any], texts: dict[WarningCode, str]) -> str:
    """A stored study with these warnings."""
    return stored(service, spec, [WarningText(text, code) for code, text in texts.items()])


def stored(service: Service, spec: dict[str, Any], warnings: list[str]) -> str:
    """A stored study with these warnings."""
    made = parse_spec(copy.deepcopy(spec))
    return service.store.studies.create(made.spec, made.study, warnings=warnings).id


def shown(service: Service, study_id: str, spoken: str, **params: str) -> list[str]:
    """The warnings on the page of a study."""
    answer = service.http.get(
        f"/studies/{study_id}", params=params, headers={"Accept": "text/html", "Accept-Language": spoken}
    )
    return [html.unescape(text) for text in re.findall(r'<p class="warning">(.*?)</p>', answer.text, re.DOTALL)]


def told(service: Service, study_id: str, choice: Choice = PAGE) -> list[str]:
    """The warnings in the report of a study, its sheet and its appendix."""
    asked = ReportQuestion(appendix=["warnings"])
    document = document_of(Library(service.store), study_id, choice, asked)
    (section,) = document.appendix
    return [block.text for block in section.blocks if isinstance(block, Text)]


@pytest.mark.parametrize("spoken", ["en", "uk"])
@pytest.mark.parametrize("model", ["drive", "shaft"])
def test_no_warning_shows_a_pointer_or_a_path(service: Service, model: str, spoken: str) -> None:
    spec, texts = (SPEC, DRIVE) if model == "drive" else (preset_of("press")["spec"], SHAFT)
    study_id = warned(service, spec, texts)
    on_page = shown(service, study_id, spoken)
    with language(spoken):
        in_report = told(service, study_id)
    assert on_page == in_report
    assert len(on_page) == len(texts)
    for text in on_page:
        assert not POINTER.search(text), text
        assert not CODE.search(text), text
        if spoken == "uk":
            assert not re.search(r"[A-Za-z]{3,}", re.sub("SPRAG_CHUNK_TIMEOUT|T_mean|Sprag", "", text)), text
    # Programs have the place.
    assert service.http.get(f"/api/v1/studies/{study_id}").json()["warnings"] == list(texts.values())


@pytest.mark.parametrize("model", ["drive", "shaft"])
def test_a_warning_is_a_whole_sentence_with_its_values(service: Service, model: str) -> None:
    drive = model == "drive"
    warnings = [*(warning_samples.of_drives() if drive else warning_samples.of_shafts())]
    study_id = stored(service, SPEC if drive else preset_of("press")["spec"], warnings)
    on_page = shown(service, study_id, "uk", units="mm")
    with language("uk"):
        assert on_page == told(service, study_id, Choice("mm"))
    assert len(on_page) == len(warnings)
    sentence = "1600 мм — це більше за 100 мм; чи не в мм його подано?" if drive else "(випадків: 2 з 3)"
    assert any(text.replace("\N{NO-BREAK SPACE}", " ").endswith(sentence) for text in on_page), on_page
    assert service.http.get(f"/api/v1/studies/{study_id}").json()["warnings"] == warnings


def test_places_are_captions_in_the_units_of_the_reader(service: Service) -> None:
    study_id = warned(service, SPEC, DRIVE)
    text = "Horizontal amplitude: 1600 mm is more than 100 mm; was it in mm?"
    assert text in [line.replace("\N{NARROW NO-BREAK SPACE}", "").replace("\N{NO-BREAK SPACE}", "")
                    for line in shown(service, study_id, "en", units="mm")]  # fmt: skip
    names = shown(service, study_id, "en", names="codes")
    assert any(line.startswith("excitation.amplitude_x: ") for line in names)
    with language("uk"):
        assert any("100 мм" in text for text in told(service, study_id, Choice("mm")))


def test_warnings_of_the_form_speak_captions(service: Service) -> None:
    values = {"text": "", "format": "json"}
    spec = {**copy.deepcopy(SPEC), "axes": [{"path": "excitation.amplitude_x", "values": ["3 mm", "2 m", "1 mm"]}]}
    import json

    values = {"/text": json.dumps(spec), "format": "json"}
    for spoken, caption in (("en", "Horizontal amplitude: "), ("uk", "Горизонтальна амплітуда: ")):
        answer = service.http.post("/new/check", data=values, headers={"Accept-Language": spoken})
        panel = answer.json()["panel"]
        warnings = re.findall(r'<p class="warning">(.*?)</p>', panel, re.DOTALL)
        assert warnings
        assert all(text.startswith(caption) for text in warnings), warnings
        assert not any(POINTER.search(text) for text in warnings)
