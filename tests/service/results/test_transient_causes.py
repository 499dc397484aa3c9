"""Why transients end is told in the reader's language, with each number in its units."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import pytest

from sprag_study.engine.machine_shaft.transient_causes import ROUGH_LOAD, Ends, cause_of
from sprag_study.engine.machine_shaft.transient_run import _FIXED_DRIVE
from sprag_study.sentences import sentence_of
from sprag_study.service.languages import language
from sprag_study.service.reading.reader import Reading

ENDS = Ends(
    angle=1.25, drive=2.0, largest_drive=3.0, resistance=-2.5, mean_resistance=-1.5, turns_back=True, within=0.05,
    cycle=True, missed=math.nan, no_cycle="",
)  # fmt: skip
RESULTS = {"duration": 1.8725, "turns": 2.4142, "omega.end": 12.345, "after.omega.mean": 15.5}


@pytest.mark.parametrize(
    ("kind", "outcome"),
    [
        *(("run-up", outcome) for outcome in ("too_stiff", "reached", "not_reached", "not_started", "stalled")),
        *(("coasting", outcome) for outcome in ("not_reached", "stopped")),
        ("load step", "reached"),
    ],
)
def test_each_cause_is_told_in_ukrainian(kind: str, outcome: str) -> None:
    english = cause_of(kind, outcome, RESULTS, ENDS)
    with language("uk"):
        told = Reading("machine-shaft").say(english)
    assert told != english
    assert not any(word in told for word in ("shaft", "torque", "The "))
    assert ("1,872" in told) == ("1.872" in english)


def test_causes_without_numbers_are_told_in_ukrainian() -> None:
    no_cycle = cause_of("run-up", "not_reached", RESULTS, replace(ENDS, cycle=False, no_cycle=_FIXED_DRIVE))
    assert _FIXED_DRIVE in no_cycle
    elsewhere = cause_of("run-up", "reached", RESULTS, replace(ENDS, missed=132.9))
    assert "at 15.5 rad/s, and not to the one at 132.9 rad/s" in elsewhere
    for english in (ROUGH_LOAD, no_cycle, elsewhere):
        with language("uk"):
            told = Reading("machine-shaft").say(english)
        assert not any(word in told for word in ("shaft", "torque", "The ")), told


def test_an_angle_is_in_degrees_in_files_and_in_the_unit_of_a_reader() -> None:
    stopped = cause_of("run-up", "stalled", RESULTS, ENDS)
    assert stopped.startswith("The shaft stops at 71.62 deg, after 1.873 s and 2.414 revolutions: ")
    assert "at 1.25 rad, after" in Reading("machine-shaft").say(stopped)


def test_a_transient_keeps_its_sentence_when_it_leaves_its_process() -> None:
    stopped = cause_of("run-up", "stalled", RESULTS, ENDS)
    known = pickle.loads(pickle.dumps(stopped))
    assert Reading("machine-shaft").say(known) == Reading("machine-shaft").say(stopped)
    assert Reading("machine-shaft").say(sentence_of(stopped.to_json())) == Reading("machine-shaft").say(stopped)
