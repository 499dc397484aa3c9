"""Requests made up from the service's own OpenAPI document by schemathesis, in all its phases, and what came of them.

The phases: the document's examples; coverage (every bound, type and missing part of every parameter and body, other
methods, refused credentials); random right and wrong requests; and sequences along the document's links.
"""

from __future__ import annotations

import copy
import json
from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

import schemathesis
from schemathesis.config import SchemathesisConfig
from schemathesis.engine import events, from_schema

if TYPE_CHECKING:
    from collections.abc import Mapping

    from schemathesis.engine.recorder import ScenarioRecorder
    from schemathesis.specs.openapi.schemas import OpenApiSchema

#: Every check that says something about this service. Left out: `missing_required_header` (there is none), and
#: `object_level_authorization` (a token of scope write may do everything).
CHECKS: Final = (
    "not_a_server_error",
    "status_code_conformance",
    "content_type_conformance",
    "response_headers_conformance",
    "response_schema_conformance",
    "negative_data_rejection",
    "positive_data_acceptance",
    "unsupported_method",
    "allow_header_conformance",
    "use_after_free",
    "ensure_resource_availability",
    "ignored_auth",
)
#: Operations whose bodies or queries keep to more than JSON Schema can say (units, cron expressions, printable texts,
#: names of a study's axes, starts of its cases, times), so that what the document allows may still be refused.
FURTHER_RULES: Final = (
    "create_study",
    "preview_study",
    "extend_study",
    "run_longer",
    "narrow_study",
    "select_cases",
    "create_schedule",
    "put_components",
    "list_cases",
    "change_schedule",
    "save_view",
    "change_view",
    "fit_clutch",
    "list_studies",
    "change_study",
    "get_curves",
    "get_answers",
    "get_exploration",
    "get_front",
    "get_calibration",
    "get_map",
    "get_report",
    "get_results",
    "get_ribbon",
    "get_yield",
    "get_sensitivity",
    "get_trajectory",
    "get_branch",
    "get_transient",
    "get_speeds",
    "get_diagram",
    "get_section",
    "get_basin",
    "get_engagements",
    "get_duty",
    "get_forces",
    "get_startup",
    "get_strobes",
    "get_audit",
    "add_user",
    "change_user",
    "hand_over_user",
    "create_token",
    "revoke_token",
)


@dataclass
class Summary:
    """What was sent and what came of it."""

    operations: int = 0
    phases: Counter[str] = field(default_factory=Counter)
    checks: Counter[str] = field(default_factory=Counter)
    statuses: Counter[int] = field(default_factory=Counter)
    served: set[str] = field(default_factory=set)
    #: Requests, and seconds until their answers, of each phase of each operation.
    spent: dict[str, tuple[int, float]] = field(default_factory=dict)
    findings: dict[str, str] = field(default_factory=dict)

    @property
    def requests(self) -> int:
        """Requests that were answered."""
        return sum(self.statuses.values())

    def note(self, phase: str, recorder: ScenarioRecorder) -> None:
        """Count the requests of a scenario and keep what a check found."""
        for identity, interaction in recorder.interactions.items():
            if interaction.response is None:
                self.findings[f"no answer: {interaction.request.method} {interaction.request.uri}"] = ""
                continue
            status = interaction.response.status_code
            self.phases[phase] += 1
            self.statuses[status] += 1
            if identity in recorder.cases:
                label = f"{phase}: {recorder.cases[identity].value.operation.label}"
                count, seconds = self.spent.get(label, (0, 0.0))
                self.spent[label] = count + 1, seconds + interaction.response.elapsed
            # Every address answers OPTIONS, which says nothing about its operations.
            if status < 400 and identity in recorder.cases and interaction.request.method != "OPTIONS":
                self.served.add(recorder.cases[identity].value.operation.label)
            for check in recorder.checks.get(identity, ()):
                self.checks[check.name] += 1
                if check.failure_info is not None:
                    operation = recorder.cases[identity].value.operation.label
                    failure = check.failure_info.failure
                    told = f"{phase}: {operation}: {check.name}: {status}: {failure.title}: {failure.message}"
                    answer = interaction.response.text[:400]
                    self.findings.setdefault(" ".join(told.split()), f"{check.failure_info.code_sample}\n{answer}")

    def __str__(self) -> str:
        statuses = ", ".join(f"{count} x {status}" for status, count in sorted(self.statuses.items()))
        phases = ", ".join(f"{phase} {count}" for phase, count in self.phases.items())
        return (
            f"{self.operations} operations, {self.requests} requests ({phases}), {sum(self.checks.values())} checks, "
            f"{len(self.findings)} findings\nanswers: {statuses}\nanswered without an error at least once: "
            f"{len(self.served)} operations"
        )


def fuzz(
    document: Mapping[str, Any],
    token: str,
    examples: int,
    *,
    app: Any = None,
    address: str = "http://localhost",
    skip: Mapping[str, tuple[str, ...]] | None = None,
) -> Summary:
    """Send requests to ``app``, or to the service at ``address``, with the token of scope write ``token``.

    ``examples`` are the requests of each kind to each operation in the random phases. The same ones are sent every
    time. ``skip`` are phases that leave out an operation, by its id.
    """
    schemathesis.serializer("application/toml")(_toml)
    config = SchemathesisConfig.from_dict(_config(token, examples, skip or {}))
    schema: OpenApiSchema = schemathesis.openapi.from_dict(copy.deepcopy(dict(document)), config=config)
    schema.app = app
    schema.config.update(base_url=address)
    summary = Summary()
    summary.operations = sum(1 for _ in schema.get_all_operations())
    for event in from_schema(schema).execute():
        if isinstance(event, events.ScenarioFinished):
            summary.note(event.phase.value, event.recorder)
        elif isinstance(event, events.NonFatalError):
            summary.findings[f"{event.label}: {event.info.title}: {event.info.message}"] = str(event.value)
        elif isinstance(event, events.FatalError):
            raise event.exception
        elif isinstance(event, events.EngineFinished):
            summary.findings |= {failure.title: failure.message for failure in event.failures}
    return summary


def _config(token: str, examples: int, skip: Mapping[str, tuple[str, ...]]) -> dict[str, Any]:
    return {
        "seed": 1,
        "continue-on-failure": True,
        "request-timeout": 120,
        "headers": {"Authorization": f"Bearer {token}"},
        "generation": {
            "max-examples": examples,
            "deterministic": True,
            "no-shrink": True,
            "database": "none",
        },
        # The document's own links only: guessed ones take the address of a verb for that of a study.
        "phases": {"stateful": {"inference": {"algorithms": []}}},
        "checks": {
            "enabled": False,
            **{name: {"enabled": True} for name in CHECKS},
            # 412: no document can say which entity tag a request must name.
            "positive_data_acceptance": {
                "enabled": True,
                "expected-statuses": ["2xx", "3xx", 401, 403, 404, 409, 412, 429, "5xx"],
            },
        },
        "operations": [
            {
                "include-operation-id": list(FURTHER_RULES),
                "checks": {"positive_data_acceptance": {"enabled": False}},
            },
            # An array of too many components is refused by its size before it is read.
            {
                "include-operation-id": "put_components",
                "checks": {
                    "positive_data_acceptance": {"enabled": False},
                    "negative_data_rejection": {"expected-statuses": ["4xx"]},
                },
            },
            # 503 is its documented answer while no worker is heard of, which the standing test service may come to.
            {
                "include-operation-id": "readyz",
                "checks": {"not_a_server_error": {"expected-statuses": ["2xx", "4xx", 503]}},
            },
            *(
                {"include-operation-id": name, "phases": {phase: {"enabled": False} for phase in phases}}
                for name, phases in skip.items()
            ),
        ],
    }


def _toml(_context: Any, value: Any) -> Any:
    """A body as it stands; whatever is no text is written as JSON, which is no TOML."""
    return value if isinstance(value, bytes) else value.encode() if isinstance(value, str) else json.dumps(value)


def with_ids(document: Mapping[str, Any], ids: Mapping[str, list[Any]]) -> dict[str, Any]:
    """The document with ids of things that there are as examples of its parameters, by their names."""
    changed = copy.deepcopy(dict(document))
    for item in changed["paths"].values():
        for operation in item.values():
            for parameter in operation.get("parameters", ()):
                if parameter["name"] in ids and parameter["in"] == "path":
                    parameter.pop("example", None)
                    parameter["schema"]["examples"] = ids[parameter["name"]]
    return changed
