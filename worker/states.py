"""The states of a study and the one table of what may follow what."""

from enum import StrEnum
from typing import ClassVar


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
        """Whether the study has come to its end."""
        return self in TERMINAL

    @property
    def sentence(self) -> str:
        """What the state means, for people."""
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
    StudyState.CANCELLING: "Cancellation was asked for; the worker is stopping its cases.",
    StudyState.CANCELLED: "Cancelled: finished cases are kept, the others will not be run.",
    StudyState.FINISHED: "Every case has an ending, at least one of them ok.",
    StudyState.FAILED: "Every case has an ending and none of them is ok.",
}

TERMINAL: frozenset[StudyState] = frozenset({StudyState.CANCELLED, StudyState.FINISHED, StudyState.FAILED})


class StudyEvent(StrEnum):
    """What can happen to a study. The first four are wishes, which the service writes; the rest is the dispatcher's."""

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

#: From a state, by an event, to a state. What is not here cannot happen.
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
    # A chunk that was running when the wish came may be the last one: then the study is complete all the same.
    (_S.QUEUED, _E.ALL_DONE): _S.FINISHED,
    (_S.RUNNING, _E.ALL_DONE): _S.FINISHED,
    (_S.PAUSED, _E.ALL_DONE): _S.FINISHED,
    (_S.CANCELLING, _E.ALL_DONE): _S.FINISHED,
    (_S.QUEUED, _E.NONE_OK): _S.FAILED,
    (_S.RUNNING, _E.NONE_OK): _S.FAILED,
    (_S.PAUSED, _E.NONE_OK): _S.FAILED,
    (_S.CANCELLING, _E.NONE_OK): _S.FAILED,
}

#: Wishes that ask for what already holds: they change nothing and are no error.
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
    """The state of a study does not allow what was asked for."""

    code: ClassVar[str] = "wrong-state"

    def __init__(self, state: StudyState, event: StudyEvent) -> None:
        super().__init__(f"a study that is {state.value} cannot take {event.value.replace('_', ' ')!r}")
        self.state = state
        self.event = event


def follow(state: StudyState, event: StudyEvent) -> StudyState:
    """The state after ``event``; raises TransitionError where the table has no such step."""
    if (state, event) in ALREADY:
        return state
    try:
        return TRANSITIONS[state, event]
    except KeyError:
        raise TransitionError(state, event) from None
