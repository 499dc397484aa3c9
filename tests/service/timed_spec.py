"""The documentation's example as a study of a given time, which costs the engine a fifth of a settled one."""

from __future__ import annotations

from typing import Any, Final

from sprag_study.service.http.api import examples

SPEC: Final[dict[str, Any]] = {
    **examples.SPEC,
    "run": {"duration": "60 periods", "window": ["40 periods", "60 periods"]},
}
