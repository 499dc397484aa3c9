"""Answers are filled from what is known of a thing, by the names of their shape."""

from __future__ import annotations

import math
from dataclasses import dataclass
from datetime import UTC, datetime

import pytest
from pydantic import ValidationError

from sprag_study.service.answers import catalogue, filled
from tests.service.shapes import fits


@dataclass
class Source:
    """What a parameter is filled from."""

    path: str = "shaft.load"
    symbol: str = "M"
    unit: str = "N*m"
    low: float = 0.0
    low_open: bool = False
    high: float = math.inf
    default: float | None = None
    help: str = "load"
    more: str = "in no answer"


def test_an_answer_has_the_fields_of_its_shape() -> None:
    answer = filled(catalogue.ParameterInfo, Source(), required=True, range=">= 0 N*m")
    assert answer["high"] is None
    assert answer["required"] is True
    assert "more" not in answer
    fits(catalogue.ParameterInfo, answer)


def test_a_field_that_nobody_knows_is_a_fault_at_once() -> None:
    with pytest.raises(AttributeError, match="range"):
        filled(catalogue.ParameterInfo, Source(), required=True)


def test_an_answer_with_a_further_field_is_refused() -> None:
    with pytest.raises(ValidationError, match="engine"):
        fits(catalogue.Health, {"status": "ok", "engine": "none"})


def test_times_are_told_in_utc() -> None:
    @dataclass
    class Once:
        status: datetime

    moment = datetime(2026, 1, 1, 12, tzinfo=UTC)
    assert filled(catalogue.Health, Once(moment), warnings=[])["status"] == "2026-01-01T12:00:00.000000Z"
