"""The Python client of the service.

    from sprag_study.service.client import Client

    with Client() as sprag:
        study = sprag.submit("study.json").wait()
        table = study.table()
        curves = study.curves("shaft.load", "shaft.speed.mean", by="excitation.frequency").to_xarray()

`AsyncClient` has the same methods as coroutines. `UnreachableError` means that no service answered at the address;
`RefusedError` carries the service's problem document. pandas, polars and xarray are loaded only when they are used.
"""

from sprag_study.service.client.asynchronous.client import AsyncClient
from sprag_study.service.client.asynchronous.study import AsyncStudy
from sprag_study.service.client.comparison import Comparison
from sprag_study.service.client.errors import (
    AmbiguousError,
    ArgumentError,
    RefusedError,
    ServiceError,
    SpecFileError,
    StatementError,
    StudyTimeoutError,
    UnreachableError,
    UntrustedError,
)
from sprag_study.service.client.events import StudyEvent
from sprag_study.service.client.frames import Curves
from sprag_study.service.client.motions import Engagements, Motion
from sprag_study.service.client.queries import preset
from sprag_study.service.client.synchronous.client import Client
from sprag_study.service.client.synchronous.comparing import compare
from sprag_study.service.client.synchronous.selecting import sql
from sprag_study.service.client.synchronous.study import Study
from sprag_study.service.client.tabular import with_units
from sprag_study.service.client.wire import Query

__all__ = [
    "AmbiguousError",
    "ArgumentError",
    "AsyncClient",
    "AsyncStudy",
    "Client",
    "Comparison",
    "Curves",
    "Engagements",
    "Motion",
    "Query",
    "RefusedError",
    "ServiceError",
    "SpecFileError",
    "StatementError",
    "Study",
    "StudyEvent",
    "StudyTimeoutError",
    "UnreachableError",
    "UntrustedError",
    "compare",
    "preset",
    "sql",
    "with_units",
]
