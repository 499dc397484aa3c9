"""Errors of the database, each with a one-sentence message."""

from sprag_study.sentences import Sentence
from sprag_study.worker.ports import StoreError, StoreFullError

__all__ = [
    "CREATED_BY",
    "ChangedMeanwhileError",
    "ComponentNotFoundError",
    "DatabaseBusyError",
    "DatabaseError",
    "DatabaseFullError",
    "EndingError",
    "IdempotencyConflictError",
    "NotOwnerError",
    "NothingToRetryError",
    "PageTokenError",
    "RunClosedError",
    "ScheduleNotFoundError",
    "SchemaError",
    "StoreError",
    "StudyBusyError",
    "StudyEndedError",
    "StudyNotFoundError",
    "TokenNotFoundError",
    "TooManyComponentsError",
    "TooManySchedulesError",
    "TooManyViewsError",
    "UserExistsError",
    "UserNotFoundError",
    "ViewNotFoundError",
    "busy",
    "in_use",
]

#: What makes a database, at the end of a sentence.
CREATED_BY = "`sprag serve`, `sprag run --db` and `sprag admin db upgrade` create one"


class DatabaseError(StoreError):
    """The database cannot be opened or used; ``code`` gives the cause where the class does not."""

    def __init__(self, message: str, code: str | None = None) -> None:
        super().__init__(message)
        if code is not None:
            self.code = code


class SchemaError(DatabaseError):
    """The revision of the database is not that of this program; the message names the command that fixes it."""

    code = "wrong-revision"


class DatabaseBusyError(DatabaseError):
    """Another process locked the database for longer than the busy timeout."""

    code = "database-busy"


def busy(where: str) -> DatabaseBusyError:
    """The error of a writer that waited in vain for the database at ``where``."""
    return DatabaseBusyError(f"another process locked the database {where} for too long; try again")


def in_use(where: str, who: str = "") -> DatabaseError:
    """The error of work that needs the database at ``where`` alone, while others (``who``) use it."""
    return DatabaseError(
        f"the database {where} is in use{who and f' by {who}'}: stop every service, worker and command that has it "
        "open, and try again",
        "database-in-use",
    )


class EndingError(DatabaseError):
    """The service is shutting down and no longer writes."""


class DatabaseFullError(DatabaseError, StoreFullError):
    """The disk is full, or writing to it fails."""

    code = "storage-full"


class StudyNotFoundError(StoreError):
    """There is no study of that id."""

    code = "study-not-found"

    def __init__(self, study_id: str) -> None:
        super().__init__(Sentence("there is no study {study}", study=repr(study_id)))
        self.study_id = study_id

    def __reduce__(self) -> "tuple[type[StudyNotFoundError], tuple[str]]":
        return StudyNotFoundError, (self.study_id,)


class ScheduleNotFoundError(StoreError):
    """There is no schedule of that id."""

    code = "schedule-not-found"

    def __init__(self, schedule_id: str) -> None:
        super().__init__(Sentence("there is no schedule {schedule}", schedule=repr(schedule_id)))


class ComponentNotFoundError(StoreError):
    """There is no component of that id."""

    code = "component-not-found"

    def __init__(self, component_id: str) -> None:
        super().__init__(Sentence("there is no component {component}", component=repr(component_id)))


class TooManyComponentsError(StoreError):
    """The limit of components is reached."""

    code = "wrong-state"


class ViewNotFoundError(StoreError):
    """There is no saved view of that id."""

    code = "view-not-found"

    def __init__(self, view_id: str) -> None:
        super().__init__(Sentence("there is no saved view {view}", view=repr(view_id)))


class TooManyViewsError(StoreError):
    """The limit of saved views is reached."""

    code = "wrong-state"


class TooManySchedulesError(StoreError):
    """The limit of schedules is reached."""

    code = "wrong-state"


class RunClosedError(StoreError):
    """The due time of a schedule has its outcome already, so it gets no study."""

    code = "wrong-state"


class TokenNotFoundError(StoreError):
    """There is no token of that id."""

    code = "token-not-found"

    def __init__(self, token_id: str) -> None:
        super().__init__(f"there is no token {token_id!r}")


class UserNotFoundError(StoreError):
    """No user has that name."""

    code = "user-not-found"

    def __init__(self, name: str) -> None:
        super().__init__(f"there is no user {name!r}")


class UserExistsError(StoreError):
    """The name belongs to a user, or did."""

    code = "user-exists"


class NotOwnerError(StoreError):
    """The object belongs to another user."""

    code = "not-owner"


class ChangedMeanwhileError(StoreError):
    """The object was changed after the edition that a change or deletion is meant for was read."""

    code = "precondition-failed"


class StudyBusyError(StoreError):
    """The study has not ended, so it cannot be deleted."""

    code = "wrong-state"


class StudyEndedError(StoreError):
    """The study has ended, so its priority cannot be changed."""

    code = "wrong-state"


class NothingToRetryError(StoreError):
    """The study has no case to run again as requested."""

    code = "wrong-state"


class IdempotencyConflictError(StoreError):
    """The idempotency key was already used with another body or other parameters."""

    code = "idempotency-conflict"


class PageTokenError(StoreError):
    """A page token that no list has issued."""

    code = "invalid-parameter"
