"""Tolerances as drawings have them, and values that are typed with one."""

from __future__ import annotations

import pytest

from sprag_study.service.reading.deviations import deviations, with_tolerance


@pytest.mark.parametrize(
    ("text", "pair"),
    [
        ("+0.05 mm/-0", ("+0.05 mm", "-0 mm")),
        ("+0,05/−0,02 мм", ("+0,05 мм", "−0,02 мм")),
        ("+0.05 -0.02 mm", ("+0.05 mm", "-0.02 mm")),
        ("0 -0.02 mm", ("0 mm", "-0.02 mm")),
        ("-0.02/+0.05 mm", ("-0.02 mm", "+0.05 mm")),
        ("+ 0.1 N*m*s/rad / - 0", ("+0.1 N*m*s/rad", "-0 N*m*s/rad")),
        ("+1e-3/-0 kg*m^2", ("+1e-3 kg*m^2", "-0 kg*m^2")),
        ("+0.05/-0", ("+0.05", "-0")),
        ("+5 %", None),
        ("3/4 in", None),
        ("100 N/m", None),
        ("-20 -30", None),
        ("+1 " * 30_000, None),
        ("0" + " " * 30_000 + "x", None),
    ],
)
def test_two_deviations_are_read_with_their_units(text: str, pair: tuple[str, str] | None) -> None:
    assert deviations(text) == pair


@pytest.mark.parametrize(
    ("text", "parts"),
    [
        ("30 mm +0.05/-0", ("30 mm", "+0.05/-0 mm")),
        ("9 ± +0.1/-0.2 N/mm", ("9 N/mm", "+0.1/-0.2 N/mm")),
        ("-0.3 rad ± 5 %", ("-0.3 rad", "5 %")),
        ("30 0 -0.02 mm", ("30 mm", "0 -0.02 mm")),
        ("10, 20, 0/-5", None),
        ("20 to 30 +1/-1", None),
        ("10 -20 -30", None),
        ("± 5 %", None),
        ("1 " + "+1 " * 30_000, None),
    ],
)
def test_a_value_is_parted_from_its_tolerance(text: str, parts: tuple[str, str] | None) -> None:
    assert with_tolerance(text) == parts
