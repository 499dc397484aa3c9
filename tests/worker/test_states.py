"""The table of a study's states."""

import pytest

from sprag_study.worker.states import ALREADY, TERMINAL, TRANSITIONS, StudyEvent, StudyState, TransitionError, follow


def test_ends_are_ends_unless_failed_cases_are_run_again() -> None:
    assert {event for state, event in TRANSITIONS if state in TERMINAL} == {StudyEvent.RETRY}
    assert StudyState.CANCELLED not in {state for state, _ in TRANSITIONS}


def test_every_state_is_reached_and_every_other_leads_to_an_end() -> None:
    assert {StudyState.QUEUED, *TRANSITIONS.values()} == set(StudyState)
    for state in set(StudyState) - TERMINAL:
        reached = {state}
        while more := {after for (before, _), after in TRANSITIONS.items() if before in reached} - reached:
            reached |= more
        assert reached >= TERMINAL


def test_no_step_is_in_both_tables() -> None:
    assert not ALREADY & set(TRANSITIONS)


@pytest.mark.parametrize("state", StudyState)
@pytest.mark.parametrize("event", StudyEvent)
def test_what_is_in_no_table_is_refused(state: StudyState, event: StudyEvent) -> None:
    if (state, event) in TRANSITIONS:
        assert follow(state, event) is TRANSITIONS[state, event]
    elif (state, event) in ALREADY:
        assert follow(state, event) is state
    else:
        with pytest.raises(TransitionError, match=state.value):
            follow(state, event)


def test_every_state_has_a_sentence() -> None:
    assert all(state.sentence.endswith(".") for state in StudyState)
