"""The role that each route needs. A route that is not listed here is for administrators only.

Reading is for everybody who may use the service; what changes something is for designers, who can change their own
and what has no owner (`sprag_study.service.storage.people.audit.require_owner`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, cast

from starlette.requests import Request

from sprag_study.service.actor import Role
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.request_log import pattern_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.service.http.grants import Grant

_S: Final = "/api/v1/studies/{study_id}"
_CASE: Final = _S + "/cases/{case}"
_PAGE: Final = "/studies/{study_id}"
_PAGE_CASE: Final = _PAGE + "/cases/{case}"

#: Routes without a login.
_ANYONE: Final = (
    "GET /livez",
    "GET /readyz",
    "GET /login",
    "POST /login",
    "POST /logout",
    "GET /login/oidc",
    "GET /login/oidc/return",
    "GET /static/{name}",
    "GET /me",
    "POST /me",
)
_VIEWER: Final = (
    "GET /api/v1/me",
    "GET /api/v1/studies", "POST /api/v1/studies:preview", "POST /api/v1/clutch-fits",
    f"GET {_S}",
    *(f"GET {_S}/{part}" for part in (
        "rounds", "events", "curves", "map", "results", "report", "sensitivity", "ribbon", "yield", "calibration",
        "front", "explore", "answers", "cases",
    )),
    f"GET {_CASE}",
    *(f"GET {_CASE}/{part}" for part in (
        "trajectory", "branch", "diagram", "section", "engagements", "duty", "forces", "strobes", "speeds", "transient",
        "basin", "startup",
    )),
    "GET /api/v1/night",
    "GET /api/v1/schedules", "GET /api/v1/schedules/{schedule_id}",
    "GET /api/v1/components", "GET /components", "GET /parts", "GET /api/v1/views",
    "GET /api/v1/models", "GET /api/v1/models/{name}", "GET /api/v1/presets", "GET /api/v1/presets/{name}",
    "GET /api/v1/workers", "GET /workers", "GET /me/workers",
    "GET /metrics", "GET /openapi.json", "GET /problems/{slug}",
    "GET /help", "GET /help/interface", "GET /help/{name}", "GET /docs", "GET /docs/{name}",
    "GET /docs/site", "GET /docs/site/{name}",
    "GET /live/{name}", "GET /units",
    "GET /", "GET /new", "POST /new/check", "POST /new/live", "POST /new/along", "GET /calibrate",
    f"GET {_PAGE}",
    *(f"GET {_PAGE}/{part}" for part in (
        "delete", "extend", "labels", "front", "explore", "explore/new", "explore/compare",
        "rows", "rows/new", "rows/file", "rows/search.svg",
        "matters", "calibration", "drives", "sensitivity", "curves", "map", "cases", "document",
        "answers", "designs", "report", "reports", "ribbon", "tolerances", "yield",
    )),
    f"GET {_PAGE_CASE}",
    *(f"GET {_PAGE_CASE}/{part}" for part in (
        "motion.svg", "laboratory", "engagements", "branch", "diagram", "basin", "transient",
        "motion", "strobes", "trajectory",
    )),
    "GET /compare", "GET /compare/picture.{form}", "GET /compare/curves.csv",
    "GET /laboratory", "GET /laboratory/{model}", "GET /laboratory/{model}/{part}",
    "GET /nights", "GET /nights/new", "GET /nights/{schedule_id}",
    "GET /night", "GET /tokens", "GET /schedules", "GET /schedules/new", "GET /schedules/{schedule_id}",
)  # fmt: skip
_DESIGNER: Final = (
    "POST /api/v1/studies",
    f"PATCH {_S}", f"DELETE {_S}",
    *(f"POST {_S}:{verb}" for verb in (
        "cancel", "pause", "resume", "retry", "extend", "longer", "narrow", "select", "prioritize", "restore",
    )),
    "POST /api/v1/components", "DELETE /api/v1/components/{component_id}",
    "POST /parts", "POST /parts/{component_id}/delete",
    "POST /api/v1/views", "PATCH /api/v1/views/{view_id}", "DELETE /api/v1/views/{view_id}",
    "POST /views", "POST /views/{view_id}",
    "POST /api/v1/schedules", "PATCH /api/v1/schedules/{schedule_id}", "DELETE /api/v1/schedules/{schedule_id}",
    "POST /new", "POST /calibrate", "POST /studies", f"POST {_PAGE}/labels", f"POST {_PAGE}/priority",
    f"POST {_PAGE}/extend",
    f"POST {_PAGE}/delete", f"POST {_PAGE}/longer/{{kind}}", f"POST {_PAGE}/narrow", f"POST {_PAGE}/{{verb}}",
    f"POST {_PAGE}/rows/longer",
    "GET /me/tokens", "POST /me/tokens",
    "POST /nights/new", "POST /nights/{schedule_id}", "POST /nights/{schedule_id}/{verb}",
)  # fmt: skip
_ADMINISTRATOR: Final = (
    "GET /api/v1/audit",
    "GET /api/v1/users",
    "POST /api/v1/users",
    "PATCH /api/v1/users/{user}",
    "POST /api/v1/users:hand-over",
    "GET /api/v1/tokens",
    "POST /api/v1/tokens",
    "POST /api/v1/tokens/{token_id}:revoke",
    "GET /me/audit",
    "GET /me/users",
    "POST /me/users",
    "GET /me/settings",
    "POST /me/settings",
    "POST /me/backups",
    "GET /audit",
    "GET /users",
)

#: Role by method and pattern; None: no login is needed.
ROLES: Final[Mapping[str, Role | None]] = {
    **dict.fromkeys(_ANYONE),
    **dict.fromkeys(_VIEWER, Role.VIEWER),
    **dict.fromkeys(_DESIGNER, Role.DESIGNER),
    **dict.fromkeys(_ADMINISTRATOR, Role.ADMINISTRATOR),
}
#: Requests that change nothing despite their method.
LOOKING: Final = frozenset(
    route.removeprefix("POST ")
    for route, role in ROLES.items()
    if role in {None, Role.VIEWER} and route.startswith("POST ")
)


def role_needed(method: str, pattern: str) -> Role | None:
    """The role that a route needs; None where no login is needed."""
    return ROLES.get(f"{method} {pattern}", Role.ADMINISTRATOR)


async def require_role(request: Request) -> None:
    """Refuse a request whose role does not suffice for its route; for all routes."""
    needed = role_needed(request.method, pattern_of(request.scope))
    grant = cast("Grant | None", request.scope.get("sprag.grant"))
    if needed is None or (grant is not None and grant.role.allows(needed)):
        return
    who = "The sender" if grant is None else grant.label
    raise ApiError("not-allowed", f"{who} must have the role {needed.value} for this.")
