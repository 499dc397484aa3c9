"""Headlines of curves against closed forms: a drive whose speed falls linearly with the load."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sprag_study.service.languages import language
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.results.headlines.along import along_headline
from sprag_study.service.results.headlines.headline import digits
from sprag_study.service.results.key_answers import answers_query, find_answers
from tests.service.results.test_key_answers import Rows, found_in, study_of

READING = Reading("vibration-drive", Units({"rad/s": "rpm", "1": "%"}))


def headline_of(
    spec: dict[str, Any], point: str | None = None, flags: dict[int, str] | None = None, **changes: Any
) -> Any:
    study = study_of(spec, **changes)
    rows = Rows(study, flags)
    return along_headline(study, found_in(study, rows, point), asked=bool(point))


def numbers_of(headline: Any) -> dict[str, str]:
    """The key numbers as they are shown."""
    return {
        one.title(READING): " ".join(
            filter(None, (one.number(READING), one.unit_text(READING), one.where.said(READING)))
        )
        for one in headline.numbers
    }


def test_a_computed_case_is_told_with_what_comes_behind_it(spec: dict[str, Any]) -> None:
    # w = 20 (1 - M): 12 rad/s = 114.6 rpm at 0.4 N*m, 86 rpm at 0.55, which is more than half of it; 0 at 1 N*m.
    headline = headline_of(spec, "400 N*mm")
    assert headline.said(READING) == (
        "At 0.4 N·m it runs at 115 rpm with 21.6 % efficiency. It stalls between 0.8 and 1 N·m."
    )
    assert headline.gap is None
    # At 0.8 N*m it has 4 rad/s, less than half of the 9 at 0.55.
    assert headline_of(spec, "0.55 N*m").said(READING).endswith("At 0.8 N·m only 38.2 rpm is left.")
    assert numbers_of(headline) == {
        "No-load speed": "191 rpm at 0 N·m",
        "Largest useful power": "4.95 W at 0.55 N·m",
        "Best efficiency": "22.3 % at 0.55 N·m",
        "Stall torque": "> 0.8 N·m below 1 N·m",
    }


def test_between_two_cases_both_are_told_and_nothing_is_interpolated(spec: dict[str, Any]) -> None:
    headline = headline_of(spec, "0.3 N*m")
    assert headline.said(READING) == (
        "No case was run at 0.3 N·m. At 0.2 N·m it runs at 153 rpm with 14.4 % efficiency. "
        "At 0.4 N·m it runs at 115 rpm with 21.6 % efficiency."
    )
    assert (headline.gap.path, headline.gap.value) == ("shaft.load", pytest.approx(0.3))
    assert (headline.gap.low, headline.gap.high) == (0.2, 0.4)


def test_without_a_point_it_is_the_nearest_case_with_a_result(spec: dict[str, Any]) -> None:
    # The base has 0.1 N*m: 0 and 0.2 are as near.
    assert headline_of(spec).sentence[0].said(READING).startswith("At 0.2 N·m")
    headline = headline_of(spec, flags={1: "not_settled"})
    assert headline.sentence[0].said(READING).startswith("At 0 N·m")
    assert headline.gap is None


def test_a_case_without_a_result_says_why(spec: dict[str, Any]) -> None:
    headline = headline_of(spec, "0.2 N*m", flags={1: "not_settled"})
    assert headline.sentence[0].said(READING) == "At 0.2 N·m there is no result: not settled."


def test_a_standing_drive_in_both_languages(spec: dict[str, Any]) -> None:
    assert headline_of(spec, "1.3 N*m").said(READING) == (
        "At 1.3 N·m it stands still. It stalls between 0.8 and 1 N·m."
    )
    with language("uk"):
        assert headline_of(spec, "1.3 N*m").sentence[0].said(READING) == "При 1,3 Н·м вал стоїть."


def test_one_curve_of_several_is_the_drive_s_own(spec: dict[str, Any]) -> None:
    axes = [
        {"path": "excitation.amplitude_x", "values": ["1 mm", "2 mm", "3 mm"]},
        {"path": "shaft.load", "values": [0, 0.2, 0.4]},
    ]
    headline = headline_of(spec, axes=axes)
    assert headline.of.said(READING) == "horizontal amplitude = 0.002 m"
    assert headline.trace.y == pytest.approx([0.04, 0.032, 0.024])


@pytest.mark.parametrize(
    ("value", "half_width", "count"),
    [(116.04, None, 3), (1234.5, None, 4), (123456.0, None, 4), (0.0121, 0.0002, 3), (116.04, 30.0, 3), (0.0, None, 3)],
)
def test_digits_follow_the_interval(value: float, half_width: float | None, count: int) -> None:
    assert digits(value, half_width) == count


def test_a_missing_mean_is_never_a_number(spec: dict[str, Any]) -> None:
    study = study_of(spec)
    rows = Rows(study)
    rows.values["shaft.speed.mean"] = np.full(study.cases, np.nan)
    found = find_answers(study, answers_query(study), None, rows)
    headline = along_headline(study, replace(found))
    assert "no result" in headline.said(READING)
    assert all(one.label != "No-load speed" for one in headline.numbers)
