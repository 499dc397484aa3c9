"""No single flipped bit of a database file gives other rows without a word; the short form of the drill ``flips``."""

from pathlib import Path

from benchmarks.faults.flips import flips


def test_no_flipped_bit_is_silent(tmp_path: Path) -> None:
    found = flips(tmp_path, count=40, seed=2, cases=500)
    assert found["silent"] == 0
    assert found["noticed"] >= 10
