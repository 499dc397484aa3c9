"""Sentences that came in English only, in the language of whoever reads them: their texts are found again.

Earlier releases stored reasons so, and a service tells them so to programs. What is stored now keeps its values
(`sprag_study.sentences`). A text that is not found stays English.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from sprag_study.sentences import Clause, Part, Sentence
from sprag_study.service.languages import ENGLISH, N_, current, gettext
from sprag_study.service.languages.recorded import (
    COPY,
    DELETED,
    DISK,
    EARLIER,
    GRACE,
    LARGEST_FILE,
    LATE,
    LATE_PART,
    MANY_STUDIES,
    NO_ROOM,
    NO_ROOM_FOR_RESULTS,
    NO_ROUND,
    NO_WORKER,
    NOT_IN_TIME,
    NOT_MADE_UP,
    NOT_SUBMITTED,
    NOT_TAKEN,
    NOT_TAKEN_SILENT,
    NOTHING_RAN,
    NOTICED_LATE,
    OFF,
    OUTSIDE_WINDOW,
    PAUSED,
    ROUNDS_DONE,
    SHARE_OF_QUEUE,
    SILENT,
    TOKEN_EXPIRED,
    TOKEN_OF_REMOVED_USER,
    TOKEN_REVOKED,
    TRIED_AGAIN,
    WAITS,
    WAITS_SILENT,
    WAITS_STALLED,
    WINDOW,
)

#: What workers write (`sprag_study.worker`), which has no languages.
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
#: The longer of two that begin alike stands first.
_ALL: Final = (
    OUTSIDE_WINDOW, WINDOW, NO_ROOM, DISK, LARGEST_FILE, EARLIER, PAUSED, DELETED, NOT_IN_TIME, TRIED_AGAIN,
    NOTICED_LATE, NOT_MADE_UP, GRACE, NOTHING_RAN, NOT_TAKEN, NOT_TAKEN_SILENT, NOT_SUBMITTED, NO_WORKER, WAITS_SILENT,
    WAITS_STALLED, WAITS, MANY_STUDIES, SHARE_OF_QUEUE, NO_ROOM_FOR_RESULTS, SILENT, LATE_PART, LATE,
    COPY, OFF, ROUNDS_DONE, NO_ROUND, TOKEN_EXPIRED, TOKEN_REVOKED, TOKEN_OF_REMOVED_USER,
    *_OF_WORKERS,
)  # fmt: skip


def said(text: str) -> str:
    """A sentence in the language of the task, with the sentences in it."""
    if current() == ENGLISH:
        return text
    sentence = sentence_in(text)
    if sentence is None:
        return text
    parts = {name: _said(part) for name, part in sentence.parts.items()}
    return gettext(sentence.text, **parts) if parts else gettext(sentence.text)


def sentence_in(text: str) -> Sentence | None:
    """The sentence that an English text is; None where it is no known one."""
    for template in _ALL:
        match = _pattern(template).fullmatch(text)
        if match is not None:
            return Sentence(template, **{name: _part(value) for name, value in match.groupdict().items()})
    return None


def _part(text: str) -> Part:
    """A part of a sentence: a sentence of its own, with its full stop or, at the end of another, without."""
    clause = sentence_in(f"{text}.")
    return sentence_in(text) or (text if clause is None else Clause(clause))


def _said(part: Part) -> str:
    if isinstance(part, Clause):
        return said(part.sentence).removesuffix(".")
    if isinstance(part, Sentence) and not part.parts:
        return gettext(part.text)
    return said(str(part))


@cache
def _pattern(template: str) -> re.Pattern[str]:
    pieces = re.split(r"\{(\w+)\}", template)
    return re.compile(
        "".join(f"(?P<{piece}>.+)" if place % 2 else re.escape(piece) for place, piece in enumerate(pieces)), re.DOTALL
    )
