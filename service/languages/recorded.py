"""Texts of sentences that are stored, such as the reason of a hold.

What is stored keeps its text beside its values (`sprag_study.sentences`). A text whose wording changes stays here,
marked for the catalogues, for what is stored.
"""

from __future__ import annotations

from typing import Final

from sprag_study.service.languages import N_

OUTSIDE_WINDOW: Final = N_("outside its window, {window}; it continues by itself")
WINDOW: Final = N_("{begin} to {end} ({zone})")
NO_ROOM: Final = N_("no room: {limit}; the study continues when there is room")
DISK: Final = N_("the disk that holds {path} has {free} MB left")
LARGEST_FILE: Final = N_("files cannot grow beyond {size} MB here (ulimit -f)")
#: Of a database that is not the deployment, and why nothing has run there.
COPY: Final = N_(
    "This database is a copy, or was moved: its schedules are off, and it sends no reports, until `sprag admin db "
    "adopt` confirms that it takes the place of the original."
)
OFF: Final = N_("this database is a copy, whose schedules are off until `sprag admin db adopt`")
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
TOKEN_EXPIRED: Final = N_("The token {token} expired at {time}; `sprag admin token create` creates another.")
NO_LONGER: Final = N_("You may no longer do this: you were removed, your token was revoked, or your role was changed.")
TOKEN_REVOKED: Final = N_("The token {token} was revoked.")
TOKEN_OF_REMOVED_USER: Final = N_("The token {token} belongs to the user {user}, who was removed.")
#: Why the OpenID provider's account lets nobody in.
NO_USER: Final = N_("{user} is not a user of this service; an administrator can add one of this name.")
USER_REMOVED: Final = N_("The user {user} was removed.")
OTHER_ACCOUNT: Final = N_(
    "Another account of the provider is the user {user} already; an administrator who removes and restores the user "
    "lets this one in."
)
#: Why a user gets no further token.
MANY_TOKENS: Final = N_("{user} has {count} valid tokens, the most at one time: revoke those that nothing uses.")
TOKENS_LATELY: Final = N_("{user} was given {count} tokens within a day, the most: try again tomorrow.")
#: Of an alert: why, as the disk and the backups have it.
BACKUP_FAILED: Final = N_("A backup of the database failed: {problem}.")
DISK_LOW: Final = N_("{free} MB are free on the disk that holds {path}, less than {least} MB (SPRAG_DISK_FREE).")
