"""CSV with decimal commas for who asks for it: the query's ``decimal``, of every answer that is CSV."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Query
from starlette.datastructures import MutableHeaders, QueryParams
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from sprag_study.service.exports.decimal_commas import DecimalCommas
from sprag_study.service.faults import choice_of
from sprag_study.service.formats import DECIMALS
from sprag_study.service.http.asked import one_of
from sprag_study.service.http.threads import Threads, in_thread


async def _decimal(
    decimal: Annotated[
        str,
        Query(
            max_length=20,
            description="decimal sign of CSV: `comma` is for spreadsheets of many countries, with semicolons between "
            "columns and a byte order mark",
            examples=["point"],  # a comma is for CSV only
            json_schema_extra=one_of(DECIMALS),
        ),
    ] = "point",
) -> None:
    choice_of("decimal", decimal, DECIMALS)


#: The query parameter ``decimal`` of an operation that also answers in CSV; `choose_format` refuses it elsewhere.
DECIMAL = Depends(_decimal)


class InDecimals:
    """ASGI application around another one, whose CSV has decimal commas where the query wants them."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http" or QueryParams(scope["query_string"]).get("decimal") != "comma":
            await self._app(scope, receive, send)
            return
        # Ranges are of the bytes that are not sent.
        scope["headers"] = [header for header in scope["headers"] if header[0] not in (b"range", b"if-range")]
        commas: DecimalCommas | None = None

        async def rewritten(message: Message) -> None:
            nonlocal commas
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                if headers.get("content-type", "").startswith("text/csv"):
                    commas = DecimalCommas()
                    del headers["content-length"], headers["accept-ranges"]
            elif message["type"] == "http.response.body" and commas is not None:
                last = not message.get("more_body", False)
                body = await in_thread(commas.feed, message.get("body", b""), last=last, threads=Threads.PIECES)
                message = {**message, "body": body}
            await send(message)

        await self._app(scope, receive, rewritten)
