"""Fixtures of the tests of answers over HTTP."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from tests.service.conftest import Service


@pytest.fixture
def ended(service: Service, spec: dict[str, Any]) -> str:
    """A study of twelve cases that has ended."""
    spec["axes"] = [{"path": "shaft.load", "linspace": [0.01, 0.5, 12]}]
    study_id = service.submit(spec)
    service.fill(study_id)
    return study_id
