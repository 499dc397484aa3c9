"""The Python client of the service.

    from sprag.service.client import Client

    with Client() as sprag:
        study = sprag.submit("study.json").wait(progress=True)
        table = study.table()
        curves = study.curves("shaft.load", "shaft.speed.mean", by="excitation.frequency").to_xarray()

`AsyncClient` has the same methods as coroutines. `UnreachableError` means that no service answered at the address;
`RefusedError` carries the service's problem document. pandas and xarray are loaded only when they are used.
"""

from sprag.service.client.aio import AsyncClient, AsyncStudy
from sprag.service.client.errors import RefusedError, ServiceError, SpecFileError, StudyTimeoutError, UnreachableError
from sprag.service.client.frames import Curves
from sprag.service.client.plain import ServiceClient
from sprag.service.client.study import Client, Study
from sprag.service.client.wire import Query

__all__ = [
    "AsyncClient",
    "AsyncStudy",
    "Client",
    "Curves",
    "Query",
    "RefusedError",
    "ServiceClient",
    "ServiceError",
    "SpecFileError",
    "Study",
    "StudyTimeoutError",
    "UnreachableError",
]
