"""A figure to download is that of the page: the same panels, curves, words and order."""

from __future__ import annotations

import re
from html import unescape
from typing import TYPE_CHECKING

import numpy as np
import pytest

from tests.service.figures.seen import Seen, chart_of, seen
from tests.service.spec_sample import changed

if TYPE_CHECKING:
    from tests.service.conftest import Service

Y = ("torque.mean", "shaft.speed.mean", "efficiency")
UNITS = "speed=rpm,torque=N*mm,frequency=rpm"


def downloaded(service: Service, page: str, svg: str) -> tuple[Seen, Seen]:
    """The figure that a page draws, and the SVG that it offers for download."""
    text = unescape(service.http.get(page).text)
    (file,) = dict.fromkeys(re.findall(rf'href="([^"]*{svg}[^"]*format=svg)"', text))
    answer = service.http.get(file)
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == "image/svg+xml"
    assert "var(--" not in answer.text
    return chart_of(text), seen(answer.text)


def alike(page: Seen, file: Seen) -> None:
    """Whether both have the same panels with the same curves, and every text of the page is in the file."""
    assert len(page.panels) == len(file.panels) > 0
    for one, other in zip(page.panels, file.panels, strict=True):
        assert [(curve.name, curve.dash) for curve in one.curves] == [
            (curve.name, curve.dash) for curve in other.curves
        ]
        for curve, same in zip(one.curves, other.curves, strict=True):
            for part, own in zip(curve.stretches, same.stretches, strict=True):
                np.testing.assert_allclose(part[[0, -1]], own[[0, -1]], rtol=0.02, atol=np.ptp(own) * 0.01)
    rest = iter(file.texts)
    assert all(text in rest for text in page.texts)


def test_a_downloaded_family_is_that_of_the_page(service: Service) -> None:
    study_id = service.submit(changed({"/axes/0/linspace/2": 4}))
    service.fill(study_id)
    query = "&".join(f"y={name}" for name in Y)
    chosen = f"x=shaft.load&by=excitation.frequency&{query}&units={UNITS}"
    page, file = downloaded(service, f"/studies/{study_id}?{chosen}", "curves?")
    assert [len(panel.curves) for panel in file.panels] == [4, 4, 4]
    assert file.has("Mean clutch torque (N·mm)", "Mean shaft speed (rpm)", "Efficiency", "Load torque (N·mm)")
    for one, other in zip(page.panels, file.panels, strict=True):
        assert {curve.name for curve in one.curves} == {curve.name for curve in other.curves}


@pytest.mark.parametrize("kind", ["heatmap", "contour"])
def test_a_downloaded_map_is_that_of_the_page(service: Service, kind: str) -> None:
    study_id = service.submit()
    service.fill(study_id)
    chosen = f"x=shaft.load&up=excitation.frequency&z=torque.mean&kind={kind}&units={UNITS}"
    page, file = downloaded(service, f"/studies/{study_id}?{chosen}", "map?")
    alike(page, file)
    assert file.has("Mean clutch torque (N·mm)", "Excitation frequency (rpm)")
    assert set(page.panels[0].fills) >= set(file.panels[0].fills) - {"#4d4d4d", "#dde3e8", "#52606d", "none"}


@pytest.mark.parametrize("form", ["svg", "png", "pdf"])
def test_a_picture_has_the_same_bytes_every_time(service: Service, form: str) -> None:
    study_id = service.submit()
    service.fill(study_id)
    address = f"/api/v1/studies/{study_id}/curves?x=shaft.load&by=excitation.frequency&y=torque.mean&format={form}"
    first, second = service.http.get(address), service.http.get(address)
    assert first.status_code == 200
    assert first.content == second.content
    assert first.content.startswith({"svg": b"<?xml", "png": b"\x89PNG", "pdf": b"%PDF"}[form])
