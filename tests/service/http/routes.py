"""Every route of a service, as a client would ask for it."""

from __future__ import annotations

import re
from typing import Any

from fastapi.routing import iter_route_contexts


def every_route(app: Any) -> list[tuple[str, str]]:
    """Method and address of every route."""
    return [
        (method, re.sub(r"\{(\w+)\}", lambda found: {"case": "0"}.get(found[1], "x_1"), str(route.path_format)))
        for route in iter_route_contexts(app.routes)
        for method in sorted(route.methods or ())
    ]
