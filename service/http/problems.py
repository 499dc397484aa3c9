"""Errors of the HTTP interface as RFC 9457 problem documents, and the catalogue of their types."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, Final, cast

from pydantic import BaseModel, ConfigDict, Field
from starlette.responses import Response

from sprag_study.sentences import Sentence, Whole, joined, whole
from sprag_study.service.faults import Fault, FaultError, Kind, parameter_error
from sprag_study.service.json_text import to_bytes
from sprag_study.service.storage.errors import PageTokenError, StoreError
from sprag_study.worker.states import TransitionError

PROBLEM_MEDIA_TYPE = "application/problem+json"
PROBLEM_PATH = "/problems/"
_LATER: Final = {"Retry-After": "5"}


@dataclass(frozen=True, slots=True)
class ProblemType:
    """A kind of problem: the last part of its type URI, status, title, and a sentence that explains it."""

    slug: Kind
    status: int
    title: str
    help: str

    @property
    def uri(self) -> str:
        """The type as a relative reference, which is stable and also a page of the service."""
        return PROBLEM_PATH + self.slug


def _catalogue(*types: ProblemType) -> dict[Kind, ProblemType]:
    return {item.slug: item for item in types}


_FIELDS_HELP = "`errors` lists every fault: where it is, what was given, what is allowed."
_P = ProblemType
PROBLEM_TYPES: dict[Kind, ProblemType] = _catalogue(
    _P("invalid-spec", 422, "The study spec is not valid", _FIELDS_HELP),
    _P("invalid-body", 422, "The request body is not valid", _FIELDS_HELP),
    _P("invalid-parameter", 422, "A request parameter is not valid", "`errors` lists each one and what is allowed."),
    _P("invalid-selection", 422, "The selection is not possible", "A curve needs a value for every axis."),
    _P(
        "idempotency-conflict",
        422,
        "The Idempotency-Key was used with another body",
        "Use a new key for a new request.",
    ),
    _P("study-not-found", 404, "Study not found", "It never existed or was deleted."),
    _P("schedule-not-found", 404, "Schedule not found", "It never existed or was deleted."),
    _P("component-not-found", 404, "Component not found", "It never existed or was deleted."),
    _P("view-not-found", 404, "Saved view not found", "It never existed, or was deleted itself or with its study."),
    _P("token-not-found", 404, "Token not found", "The ids of tokens are at /api/v1/tokens, for administrators."),
    _P("user-not-found", 404, "User not found", "The names of users are at /api/v1/users, for administrators."),
    _P("case-not-found", 404, "Case not found", "Cases are numbered from 0."),
    _P("not-found", 404, "There is nothing at this address", "The addresses of the interface are at /help/interface."),
    _P(
        "method-not-allowed", 405, "This address does not support this method", "The header Allow lists those it takes."
    ),
    _P("not-acceptable", 406, "No acceptable format", "`detail` names the available media types."),
    _P("wrong-state", 409, "The state of the study does not allow this", "Check the state of the study first."),
    _P("user-exists", 409, "There is such a user already", "Change this one, or restore it where it is removed."),
    _P(
        "precondition-failed",
        412,
        "It was changed after you read it",
        "Read it again, and send the change with the new entity tag in If-Match.",
    ),
    _P("not-computed", 409, "The case cannot be computed", "Running it ends the process that computes it."),
    _P("body-too-large", 413, "The request body is too large", "A study is a small document: give axes as ranges."),
    _P(
        "range-not-satisfiable",
        416,
        "The file has no such part",
        "Content-Range says how many bytes it has.",
    ),
    _P("unsupported-media-type", 415, "The content type is not supported", "Send the type that `detail` names."),
    _P("bad-request", 400, "The request cannot be read", "It is not valid HTTP."),
    _P(
        "unauthorized",
        401,
        "A valid token is needed",
        "Send `Authorization: Bearer <token>`; browsers: /login.",
    ),
    _P(
        "read-only",
        403,
        "You can look at everything and change nothing",
        "Changes need a token of scope `write` or, for users, the role designer.",
    ),
    _P("not-allowed", 403, "Your role does not allow this", "An administrator can do it, or change your role."),
    _P("not-owner", 403, "This belongs to somebody else", "Its owner and administrators can change it."),
    _P("too-slow", 408, "The request arrived too slowly", "Send the whole body at once."),
    _P("cross-site", 403, "Requests from other sites are refused", "A browser sent it for a page of another site."),
    _P("wrong-host", 421, "The request is addressed to another host", "SPRAG_ALLOWED_HOSTS allows further names."),
    _P(
        "too-many-attempts",
        429,
        "Too many attempts with invalid tokens",
        "Wait for the time given by the header Retry-After.",
    ),
    _P("too-costly", 422, "This takes too much time or memory", "Request a smaller study, formula or picture."),
    _P("too-many-requests", 429, "Too many requests of one token at once", "Wait for the time given by Retry-After."),
    _P("queue-full", 429, "Too many studies are waiting", "Wait until some have ended, or cancel some."),
    _P("quota-exceeded", 429, "Your quota is used up", "Wait until studies have ended, or delete some."),
    _P("internal", 500, "The service failed", "This is a bug in the program; the server's log has the details."),
    _P(
        "unavailable",
        503,
        "The service cannot do this now",
        "Try again later; `sprag admin doctor` looks for the cause.",
    ),
    _P("storage-full", 507, "There is no room for this", "Free space on the disk, or delete studies."),
    _P("timed-out", 504, "The computation took too long", "Request a shorter part of the run."),
)


#: Seconds after which a refused request is worth another attempt, where the refusal itself does not say.
RETRY_SECONDS: Final = "10"


class ApiError(FaultError):
    """A fault with its HTTP status and headers.

    Attributes
    ----------
    headers : mapping
        Headers that the answer must have.
    """

    code: Kind

    def __init__(
        self, code: Kind, detail: str, faults: Iterable[Fault] = (), headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(code, detail, faults)
        self.headers = dict(headers or {})

    @property
    def type(self) -> ProblemType:
        """The catalogue's entry."""
        return PROBLEM_TYPES[self.code]


def api_error(fault: FaultError) -> ApiError:
    """The fault as an ApiError."""
    if isinstance(fault, ApiError):
        return fault
    headers = {} if fault.retry_after is None else {"Retry-After": str(fault.retry_after)}
    return ApiError(cast("Kind", fault.code), fault.detail, fault.faults, headers)


def as_api_error(error: Exception) -> ApiError | None:
    """The error for the client; None when the exception is a bug in the program."""
    if isinstance(error, FaultError):
        return api_error(error)
    if isinstance(error, PageTokenError):
        fault = parameter_error("page_token", "invalid-text", str(error), allowed="`next_page_token` of a page")
        return api_error(fault)
    if isinstance(error, TransitionError | StoreError):
        kind: Kind = error.code if error.code in PROBLEM_TYPES else "unavailable"
        return ApiError(kind, _sentence(error), headers=_LATER if kind == "unavailable" else None)
    return None


def _sentence(error: Exception) -> str:
    clause = error.args[0] if error.args else ""
    return joined("", (Whole(clause),)) if isinstance(clause, Sentence) else whole(str(error))


def problem_json(kind: ProblemType, detail: str, faults: Iterable[Fault] = ()) -> dict[str, Any]:
    """A problem document as JSON data."""
    document: dict[str, Any] = {"type": kind.uri, "title": kind.title, "status": kind.status, "detail": detail}
    items = [item.to_json() for item in faults]
    if items:
        document["errors"] = items
    return document


def problem_response(error: ApiError) -> Response:
    """The HTTP response for ``error``."""
    body = to_bytes(problem_json(error.type, error.detail, error.faults))
    headers = {"Cache-Control": "no-store", **error.headers}
    if error.type.status in (429, 503):
        headers.setdefault("Retry-After", RETRY_SECONDS)
    return Response(body, status_code=error.type.status, media_type=PROBLEM_MEDIA_TYPE, headers=headers)


class FaultModel(BaseModel):
    """One fault of a request."""

    pointer: str | None = Field(default=None, description="JSON Pointer to the faulty place in the body")
    parameter: str | None = Field(default=None, description="name of the faulty parameter, where it is not in the body")
    code: str = Field(description="what is wrong, stable; docs/faults.md lists the codes")
    message: str = Field(description="what is wrong, as a sentence")
    value: Any = Field(default=None, description="what was received, shortened")
    allowed: str | None = Field(default=None, description="what is allowed: a range, or the possible values")
    unit: str | None = Field(default=None, description="SI unit of the value")
    sentences: dict[str, dict[str, Any]] | None = Field(
        default=None, description="`message` and `allowed` with their values apart, for who translates them"
    )


class Problem(BaseModel):
    """Problem document (RFC 9457)."""

    model_config = ConfigDict(extra="allow")

    type: str = Field(description="kind of problem: a stable reference, and a page that explains it")
    title: str
    status: int
    detail: str = Field(description="what went wrong this time")
    errors: list[FaultModel] | None = Field(default=None, description="every fault found, where there can be several")
