"""Sentences that are stored in English, such as the reason of a hold, in the language of whoever reads them.

Who stores one fills its template with `str.format`; `said` finds the template again. A text without one stays English.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from sprag.service.languages import ENGLISH, N_, current, gettext

OUTSIDE_WINDOW: Final = N_("outside its window, {window}; it continues by itself")
WINDOW: Final = N_("{begin} to {end} ({zone})")
NO_ROOM: Final = N_("no room: {limit}; the study continues when there is room")
DISK: Final = N_("the disk that holds {path} has {free} MB left")
LARGEST_FILE: Final = N_("files cannot grow beyond {size} MB here (ulimit -f)")
#: Of a database that is not the deployment, and why nothing has run there.
COPY: Final = N_(
    "This database is a copy, or was moved: its schedules are off, and it sends no reports, until `sprag db adopt` "
    "confirms that it takes the place of the original."
)
OFF: Final = N_("this database is a copy, whose schedules are off until `sprag db adopt`")
#: Of an alarm of the watchdog, and why.
NOTHING_RAN: Final = N_("It was due at {due}, and nothing has run: {why}.")
NOT_TAKEN: Final = N_("the worker has not taken it up")
NOT_TAKEN_SILENT: Final = N_("no worker has taken it up")
NOT_SUBMITTED: Final = N_("its study is not submitted yet; {problem}")
NO_WORKER: Final = N_("no worker is running")
WAITS_SILENT: Final = N_("its study waits, and no worker has responded for a quarter of an hour")
WAITS: Final = N_("its study waits; {problem}")
WAITS_STALLED: Final = N_("its study waits, and no chunk of any study has been finished for two hours")
EARLIER: Final = N_("The earlier study {study} had not ended.")
PAUSED: Final = N_("The schedule was paused before a study was submitted.")
DELETED: Final = N_("The schedule was deleted before a study was submitted.")
NOT_IN_TIME: Final = N_("No worker was running until its deadline or the end of its misfire grace had passed.")
TRIED_AGAIN: Final = N_("{problem} It is tried again until {time}.")
NOTICED_LATE: Final = N_("No worker was running when it was due, and this was noticed {delay} (h:min:s) later; {rule}.")
NOT_MADE_UP: Final = N_("missed due times are not made up for")
GRACE: Final = N_("its misfire grace is {grace}")
MANY_STUDIES: Final = N_("{count} studies have not ended yet.")
SHARE_OF_QUEUE: Final = N_(
    "{mine} of your studies have not ended yet, and {free} more can wait, which are for others: nobody has more than "
    "is left."
)
NO_ROOM_FOR_RESULTS: Final = N_("The results would take about {size}; the database has room for {room} more.")
SILENT: Final = N_(
    "the worker (process {process}) has not responded since {since}; the study continues when a worker is at work"
)
#: Of a study whose deadline has passed: with the complete part of its order, and without.
LATE_PART: Final = N_(
    "its deadline passed at {time}: {done} of {cases} cases are done; {part}. Resume it to run the others too."
)
LATE: Final = N_("its deadline passed at {time}: {done} of {cases} cases are done. Resume it to run the others too.")
ROUNDS_DONE: Final = N_("round {round} of at most {most} is done")
NO_ROUND: Final = N_("no round is done")
#: Why a token lets nobody in.
TOKEN_EXPIRED: Final = N_("The token {token} expired at {time}; `sprag token create` creates another.")
TOKEN_REVOKED: Final = N_("The token {token} was revoked.")
TOKEN_OF_REMOVED_USER: Final = N_("The token {token} belongs to the user {user}, who was removed.")
#: What workers write (`sprag.worker`), which has no languages.
_OF_WORKERS: Final = (
    N_("no pass of {total} is complete"),
    N_("pass {complete} of {total} is complete, a grid of {values} values"),
    N_("pass {complete} of {total} is complete, {cases} cases"),
    N_("The kernel of this study is being compiled, once, which can take a minute; other studies continue."),
    N_("{reason}; the same happened with newly compiled kernels"),
    N_("engine fault: {count} different chunks crashed with no success between them ({detail})"),
    N_("engine fault: {count} different chunks crashed with no success between them"),
    N_("The scheduler {address} cannot be reached; retrying: {trouble}"),
    N_("{shortage} The worker {address} is refused: {refusal}."),
    N_("No usable worker has joined the scheduler {address}; the study waits for one."),
    N_("The processes of the pool end as they start; the log says why."),
)
#: The beginnings of error pages.
_OF_ERRORS: Final = (
    N_("There is nothing at {address}."),
    N_("There is no study {study}."),
    N_("There is no schedule {schedule}."),
    N_("There is no saved view {view}."),
    N_("There is no component {component}."),
    N_("The service failed to answer; the fault is in its log."),
    N_("{method} is not possible here; possible: {methods}."),
    N_("A study that is {state} cannot take {action}."),
    N_("Unknown action."),
    N_("Unknown kind of problem."),
    N_("Unknown page; known pages: {pages}."),
    N_("Unknown example; known examples: {examples}."),
    N_("Unknown machine; known machines: {machines}."),
    N_("Unknown question; known questions: {questions}."),
    N_("Unknown axis; known axes: {axes}."),
    N_("No case of this study is of this kind."),
    N_("The case did not end ok, so it has no motion to draw."),
    N_("Too many computations are waiting already."),
    N_("The process for computations cannot be started."),
    N_("The process that ran the computation died."),
)

#: The longer of two that begin alike stands first.
_ALL: Final = (
    OUTSIDE_WINDOW, WINDOW, NO_ROOM, DISK, LARGEST_FILE, EARLIER, PAUSED, DELETED, NOT_IN_TIME, TRIED_AGAIN,
    NOTICED_LATE, NOT_MADE_UP, GRACE, NOTHING_RAN, NOT_TAKEN, NOT_TAKEN_SILENT, NOT_SUBMITTED, NO_WORKER, WAITS_SILENT,
    WAITS_STALLED, WAITS, MANY_STUDIES, SHARE_OF_QUEUE, NO_ROOM_FOR_RESULTS, SILENT, LATE_PART, LATE,
    COPY, OFF, ROUNDS_DONE, NO_ROUND, TOKEN_EXPIRED, TOKEN_REVOKED, TOKEN_OF_REMOVED_USER,
    *_OF_WORKERS, *_OF_ERRORS,
)  # fmt: skip


def said(text: str) -> str:
    """A stored sentence in the language of the task, with the sentences in it."""
    if current() == ENGLISH:
        return text
    for template in _ALL:
        found = _pattern(template).fullmatch(text)
        if found is not None:
            parts = {name: _part(name, value) for name, value in found.groupdict().items()}
            return gettext(template, **parts) if parts else gettext(template)
    return text


def _part(name: str, text: str) -> str:
    """A part of a sentence: a state, a sentence of its own, with its full stop or, at the end of another, without."""
    if name == "state":
        return gettext(text)
    found = said(text)
    return said(f"{text}.").removesuffix(".") if found == text else found


@cache
def _pattern(template: str) -> re.Pattern[str]:
    pieces = re.split(r"\{(\w+)\}", template)
    return re.compile(
        "".join(f"(?P<{piece}>.+)" if place % 2 else re.escape(piece) for place, piece in enumerate(pieces)), re.DOTALL
    )
