"""The states of a study and the table of their transitions."""

from enum import StrEnum
from typing import ClassVar

from sprag_study.sentences import Sentence


class StudyState(StrEnum):
    """State of a study. The member's value is what is stored and shown."""

    QUEUED = "queued"
    RUNNING = "running"
    PAUSED = "paused"
    CANCELLING = "cancelling"
    CANCELLED = "cancelled"
    FINISHED = "finished"
    FAILED = "failed"

    @property
    def terminal(self) -> bool:
        """Whether the study has ended."""
        return self in TERMINAL

    @property
    def going(self) -> bool:
        """Whether cases are run, or will be as soon as a worker is free."""
        return self in GOING

    @property
    def sentence(self) -> str:
        """Description of the state."""
        return _SENTENCES[self]


class ChunkState(StrEnum):
    """State of a chunk. The member's value is what is stored."""

    WAITING = "waiting"
    CLAIMED = "claimed"
    DONE = "done"


_SENTENCES = {
    StudyState.QUEUED: "Accepted; waits for a worker.",
    StudyState.RUNNING: "Cases are being run.",
    StudyState.PAUSED: "Held: finished cases are kept, no new ones are started until it is resumed.",
    StudyState.CANCELLING: "Cancellation was requested; the worker is stopping its cases.",
    StudyState.CANCELLED: "Cancelled: finished cases are kept, the others will not be run.",
    StudyState.FINISHED: "Every case has an ending, at least one of them ok.",
    StudyState.FAILED: "Every case has an ending and none of them is ok.",
}

TERMINAL: frozenset[StudyState] = frozenset({StudyState.CANCELLED, StudyState.FINISHED, StudyState.FAILED})

GOING: frozenset[StudyState] = frozenset({StudyState.QUEUED, StudyState.RUNNING})


class StudyEvent(StrEnum):
    """Events of a study. The first four are requests, which the service writes; the others come from the dispatcher."""

    PAUSE = "pause"
    RESUME = "resume"
    CANCEL = "cancel"
    RETRY = "retry"
    START = "start"
    FAULT = "fault"
    CANCEL_DONE = "cancel_done"
    ALL_DONE = "all_done"
    NONE_OK = "none_ok"


_S, _E = StudyState, StudyEvent

#: (state, event) -> next state. Other transitions are impossible.
TRANSITIONS: dict[tuple[StudyState, StudyEvent], StudyState] = {
    (_S.QUEUED, _E.PAUSE): _S.PAUSED,
    (_S.RUNNING, _E.PAUSE): _S.PAUSED,
    (_S.PAUSED, _E.RESUME): _S.QUEUED,
    (_S.QUEUED, _E.CANCEL): _S.CANCELLING,
    (_S.RUNNING, _E.CANCEL): _S.CANCELLING,
    (_S.PAUSED, _E.CANCEL): _S.CANCELLING,
    (_S.FINISHED, _E.RETRY): _S.QUEUED,
    (_S.FAILED, _E.RETRY): _S.QUEUED,
    (_S.QUEUED, _E.START): _S.RUNNING,
    (_S.RUNNING, _E.FAULT): _S.PAUSED,
    (_S.QUEUED, _E.FAULT): _S.PAUSED,
    (_S.CANCELLING, _E.CANCEL_DONE): _S.CANCELLED,
    # A chunk that was running at the time of the request may be the last one; the study is then complete anyway.
    (_S.QUEUED, _E.ALL_DONE): _S.FINISHED,
    (_S.RUNNING, _E.ALL_DONE): _S.FINISHED,
    (_S.PAUSED, _E.ALL_DONE): _S.FINISHED,
    (_S.CANCELLING, _E.ALL_DONE): _S.FINISHED,
    (_S.QUEUED, _E.NONE_OK): _S.FAILED,
    (_S.RUNNING, _E.NONE_OK): _S.FAILED,
    (_S.PAUSED, _E.NONE_OK): _S.FAILED,
    (_S.CANCELLING, _E.NONE_OK): _S.FAILED,
}

#: Requests for the current state, which change nothing and are not errors.
ALREADY: frozenset[tuple[StudyState, StudyEvent]] = frozenset(
    {
        (_S.PAUSED, _E.PAUSE),
        (_S.QUEUED, _E.RESUME),
        (_S.RUNNING, _E.RESUME),
        (_S.CANCELLING, _E.CANCEL),
        (_S.CANCELLED, _E.CANCEL),
        (_S.RUNNING, _E.START),
    }
)


class TransitionError(Exception):
    """The state of a study does not allow the request."""

    code: ClassVar[str] = "wrong-state"

    def __init__(self, state: StudyState, event: StudyEvent) -> None:
        action = repr(event.value.replace("_", " "))
        super().__init__(
            Sentence("a study that is {state} cannot take {action}", state=Sentence(state.value), action=action)
        )
        self.state = state
        self.event = event


def follow(state: StudyState, event: StudyEvent) -> StudyState:
    """The state after ``event``; raises TransitionError where the table has no such transition."""
    if (state, event) in ALREADY:
        return state
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise TransitionError(state, event) from None
