"""Work for a request in other processes: ended when its client disconnects, and limited by the share of its token."""

from __future__ import annotations

import asyncio
from contextlib import aclosing
from functools import partial
from typing import TYPE_CHECKING, Annotated, Final, TypeVar, TypeVarTuple, cast

from fastapi import Depends, Request
from starlette.requests import ClientDisconnect

from sprag_study.service import languages
from sprag_study.service.http.context import study_with
from sprag_study.service.http.grants import OPEN
from sprag_study.service.http.requests import as_body_problems
from sprag_study.service.http.respond import streamed
from sprag_study.service.http.shares import turn
from sprag_study.service.http.threads import end_moment, in_thread
from sprag_study.service.jobs import checks
from sprag_study.service.jobs.submission import Order, take_in
from sprag_study.service.languages.elsewhere import speak
from sprag_study.service.results.start_states import check_start
from sprag_study.service.spec.machine.shaft_check import NotCompiledError
from sprag_study.service.storage.database.session import in_one_moment
from sprag_study.worker import models, traces
from sprag_study.worker.limits import FILE_WAIT_SECONDS

if TYPE_CHECKING:
    from collections.abc import AsyncGenerator, Callable, Coroutine, Iterator
    from typing import Any, BinaryIO

    from starlette.responses import Response

    from sprag_study.service.http.computer import Computes
    from sprag_study.service.http.context import Context
    from sprag_study.service.http.grants import Grant
    from sprag_study.service.http.shares import Shares
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.spec.text import Body
    from sprag_study.service.storage.studies.records import StudyRecord
    from sprag_study.worker.models import KernelShape
    from sprag_study.worker.study import Study

#: Problems that any check can lead to.
CHECK_PROBLEMS: Final = ("too-costly", "not-computed", "too-many-requests", "unavailable")

Args = TypeVarTuple("Args")
R = TypeVar("R")


class Work:
    """One request, the service's context, and access to the processes that evaluate user input.

    Every method raises ApiError when there is too much work or a limit of time or memory is reached, and
    ClientDisconnect when the client has disconnected.
    """

    def __init__(self, request: Request) -> None:
        self.request = request
        self.context = cast("Context", request.app.state.context)

    async def check(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The value of a function that reads, expands, fits or draws user input."""
        try:
            return await self._check(function, *args)
        except NotCompiledError as error:  # the first use on a machine
            await self.load(error.shape)
            return await self._check(function, *args)

    async def read(self, read: Callable[..., R], body: Body, *args: Any) -> R:
        """What ``read`` makes of the body of the request, which is no spec; ApiError where it is invalid."""
        with as_body_problems():
            return await self.check(checks.of_body, read, body, *args)

    async def submit(
        self, study: Callable[..., ParsedSpec], *args: Any, key: str | None = None, priority: int = 0, **order: Any
    ) -> StudyRecord:
        """Submit the ``study`` that a function of `checks` makes of ``args``, under an idempotency ``key``.

        ``order`` are attributes of an `Order`. Raises as the function and `take_in` do.
        """
        asked = Order(self.context.store.clock.now(), **order)
        made = await self.check(checks.submitted, asked, study, self.context.library, *args)
        return await in_thread(take_in, self.context.store, made, key, priority)

    async def _check(self, function: Callable[[*Args], R], *args: *Args) -> R:
        context = self.context
        quota = self._grant.checks
        most = (context.settings.user_checks if quota is None else quota) if self._grant.user is not None else 0
        return await self._attended(
            self._in_turn(
                context.check_shares, context.checker, most, in_one_moment, traces.carried("check", function), *args
            )
        )

    async def compute(self, function: Callable[[*Args], R], *args: *Args) -> R:
        """The value of a function of the engine."""
        context = self.context
        return await self._attended(
            self._in_turn(context.compute_shares, context.computer, 0, traces.carried("compute", function), *args)
        )

    async def kept_file(self, tag: str, function: Callable[[*Args, str, str], None], *args: *Args) -> BinaryIO:
        """The kept file of a tag, open for reading, which a process writes first where it is not there.

        ``function(*args, path, folder)`` writes it, with a folder for what it needs in between. Raises OSError where
        there is no place for files.
        """
        context, owner = self.context, self._grant.share

        async def write(path: str, folder: str) -> None:
            await context.writer.run(traces.carried("write file", function), *args, path, folder)

        own_turn = partial(context.file_shares.take, owner, seconds=FILE_WAIT_SECONDS)
        return await self._attended(context.files.opened(tag, owner, own_turn, write))

    async def rows(
        self, media_type: str, name: str, function: Callable[[*Args, str], Iterator[bytes]], *args: *Args
    ) -> Response:
        """The answer with the pieces of ``function(*args, folder)``, run in a process that ends with the client."""
        context, owner = self.context, self._grant.share

        async def pieces() -> AsyncGenerator[bytes]:
            async with (
                context.file_shares.take(owner, seconds=FILE_WAIT_SECONDS),
                turn(context.sending, FILE_WAIT_SECONDS, "Rows that are sent to others"),
                context.files.scratch() as folder,
                aclosing(context.writer.stream(function, *args, folder)) as made,
            ):
                async for piece in made:
                    yield piece

        begin = partial(context.files.with_room, lambda: streamed(pieces(), media_type, name))
        return await self._attended(begin())

    async def run_case(self, function: Callable[[Study, *Args], R], study: Study, *args: *Args) -> R:
        """The value of a function that runs a case of ``study``, once its kernel is ready."""
        await self.load(models.shape_of(study))
        return await self.compute(function, study, *args)

    async def case_of(
        self, study_id: str, case: int, look: Callable[[Study], R], start: int | None = None
    ) -> tuple[Study, R]:
        """The study, when it has that case, and what ``look`` finds in it.

        Raises ApiError, also where the case has no such ``start``, and what ``look`` does.
        """

        def find() -> tuple[Study, R]:
            study = study_with(self.context, study_id, case)
            check_start(study, start)
            return study, look(study)

        return await in_thread(find)

    async def load(self, shape: KernelShape) -> None:
        """Load a kernel, compiling it if necessary; the compilation continues when the client disconnects."""
        await self._attended(self.context.computer.load(shape))

    @property
    def _grant(self) -> Grant:
        return cast("Grant | None", self.request.scope.get("sprag.grant")) or OPEN

    async def _in_turn(
        self, shares: Shares, computer: Computes, at_most: int, function: Callable[[*Args], R], *args: *Args
    ) -> R:
        async with shares.take(self._grant.share, at_most):
            # The other process begins in English.
            return await computer.run(speak, languages.current(), function, *args)

    async def _attended(self, work: Coroutine[Any, Any, R]) -> R:
        """The value of ``work``, which is cancelled when the client disconnects."""
        try:
            await end_moment()  # the work may take long
        except BaseException:
            work.close()  # nobody awaits it
            raise
        doing, leaving = asyncio.ensure_future(work), asyncio.ensure_future(self._left())
        try:
            await asyncio.wait((doing, leaving), return_when=asyncio.FIRST_COMPLETED)
            if doing.done():
                return doing.result()
            leaving.result()
            raise ClientDisconnect
        finally:
            for task in (doing, leaving):
                task.cancel()
            await asyncio.gather(doing, leaving, return_exceptions=True)

    async def _left(self) -> None:
        """Wait until the client has disconnected."""
        while (await self.request.receive())["type"] != "http.disconnect":
            pass


async def _work(request: Request) -> Work:
    return Work(request)


Attended = Annotated[Work, Depends(_work)]
