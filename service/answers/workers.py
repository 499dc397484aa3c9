"""Answers about the workers: the processes that run cases."""

from __future__ import annotations

from typing import Annotated

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Moment


class HostWorkers(TypedDict):
    """The workers of one host."""

    host: str
    processor: Annotated[str, Doc('its processor as LLVM names it, such as "znver5"; empty where it is not known')]
    workers: int
    usable: Annotated[int, Doc("workers that are given chunks")]
    refused: int
    busy: Annotated[int, Doc("workers that run a chunk or load a kernel")]
    idle_threads: Annotated[int, Doc("threads of usable workers that run nothing")]
    cases_per_second: Annotated[float, Doc("over the last minute")]


class RefusedWorker(TypedDict):
    """A worker that is given nothing."""

    address: str
    host: str
    reason: str


class Dispatcher(TypedDict):
    """A dispatcher and its workers, as it last reported them."""

    owner: Annotated[str, Doc("host and process")]
    fingerprint: Annotated[str, Doc("SHA-256 of its code and libraries, and of those of all its workers")]
    differs: Annotated[
        str | None, Doc("how its fingerprint differs from that of the first dispatcher here; null where it does not")
    ]
    studies: Annotated[int, Doc("studies that belong to it")]
    started_at: Moment
    heartbeat_at: Moment
    ended_at: Annotated[Moment | None, Doc("null while it is at work")]
    silent: Annotated[bool, Doc("the last report is older than a minute, so the workers are not known")]
    executor: Annotated[str | None, Doc("`pool` or `dask`; null before the first report")]
    scheduler: Annotated[str | None, Doc("address of the cluster's scheduler")]
    dashboard: Annotated[str | None, Doc("URL of the scheduler's own pages")]
    shortage: Annotated[str | None, Doc("why nothing can be run at present")]
    chunks_in_flight: int
    usable: Annotated[int, Doc("workers of all hosts; 0 while they are not known")]
    hosts: list[HostWorkers]
    refused: Annotated[list[RefusedWorker], Doc("at most 100 of them; the hosts have their numbers")]


class WorkerList(TypedDict):
    """The dispatchers and their workers."""

    usable: Annotated[int, Doc("workers that are given chunks, of all dispatchers")]
    chunks_in_flight: int
    dispatchers: Annotated[
        list[Dispatcher], Doc("those at work, by their beginning; without any, the last one; empty before the first")
    ]
