"""Nights by a moved clock: reports are sent once each, and none is lost when processes are killed in between."""

from __future__ import annotations

from pathlib import Path

from benchmarks.faults.nights import nights


def test_two_nights_under_kills(tmp_path: Path) -> None:
    """A process submits, runs, concludes and sends, and is killed; what is stored and has arrived is compared."""
    figures = nights(tmp_path, count=2, seed=1)
    assert sum(figures["killed"].values()) == 2
    assert figures["studies"] == 2 * figures["nights"] >= 4
    assert (figures["mails"], figures["webhooks"]) == (2 * figures["studies"], figures["studies"])
