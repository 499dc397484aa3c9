"""plotly's script with only what figures of this program use: a fourth of the whole (docs/adr/0026-part-of-plotly.md).

The script of the Python package is a bundle by esbuild. Each CommonJS module in it is a statement of its own,
``var NAME=WRAP((exports,module)=>{...});``, and ``NAME()`` is the only way to it; ES modules follow such a statement
and are only used after ``INIT()`` of their ``INIT=LAZY(()=>{...})``. The last module registers the kinds of traces.
With fewer of them registered, most other statements are out of reach and are left out; nothing else is changed.
"""

from __future__ import annotations

import gzip
import logging
import re
from dataclasses import dataclass
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

#: Kinds of traces that figures have beside scatter, which is always there.
TRACES: Final = ("bar", "heatmap", "contour")

_NAME: Final = r"[\w$]+"
_WRAP: Final = re.compile(
    rf"var ({_NAME})=\({_NAME},{_NAME}\)=>\(\)=>\{{try\{{return {_NAME}\|\|{_NAME}\(\({_NAME}=\{{exports:"
)
_LAZY: Final = re.compile(
    rf"var ({_NAME})=\({_NAME},{_NAME},{_NAME}\)=>\(\)=>\{{if\({_NAME}\)throw {_NAME}\[0\];try\{{"
)
_REGISTERED: Final = re.compile(rf"{_NAME}\.register\(\[((?:{_NAME}\(\),?)+)\]\);{_NAME}\.exports=")
_CALL: Final = re.compile(rf"({_NAME})\(\)")
_EXPORT: Final = re.compile(rf"exports=({_NAME})\(\)")
_TRACE: Final = re.compile(r'moduleType:"trace".*?name:"(\w+)"')

_log = logging.getLogger(__name__)


class UnknownBundleError(ValueError):
    """The script is not bundled as expected, so it cannot be taken apart."""


@dataclass(frozen=True, slots=True)
class Script:
    """The script as it is sent: plain, and compressed by gzip."""

    plain: bytes
    packed: bytes


@lru_cache(maxsize=1)
def plotly_script() -> Script:
    """The script for the pages, built once per process, in about a second.

    It is the whole one of a version that is bundled in another way.
    """
    text = whole_script()
    try:
        text = reduced(text)
    except UnknownBundleError as error:
        _log.warning("Pages load the whole script of plotly: %s.", error)
    plain = text.encode()
    return Script(plain, gzip.compress(plain, 9, mtime=0))


def whole_script() -> str:
    """The script of the installed package."""
    return (files("plotly") / "package_data" / "plotly.min.js").read_text(encoding="utf-8")


def reduced(text: str, traces: Iterable[str] = TRACES) -> str:
    """The script without modules that only other kinds of ``traces`` need; raises UnknownBundleError."""
    wrap, lazy, registered = (pattern.search(text) for pattern in (_WRAP, _LAZY, _REGISTERED))
    if wrap is None or lazy is None or registered is None:
        raise UnknownBundleError("its bundle has no modules")
    begins = re.compile(rf"(?<=;)var ({_NAME})={re.escape(wrap[1])}\((?=\(|{_NAME}=>)")
    found = list(begins.finditer(text))
    end = text.find("return ", registered.end())
    if not found or end < 0 or not found[-1].start() < registered.start() < end:
        raise UnknownBundleError("its last module registers no traces")
    edges = [*(match.start() for match in found), end]
    modules = {match[1]: text[edges[index] : edges[index + 1]] for index, match in enumerate(found)}
    kept = _kept(registered[1].split(","), modules, set(traces))
    last = found[-1][1]
    modules[last] = modules[last].replace(registered[1], ",".join(kept))
    head = text[: edges[0]]
    needed = _reached(
        {last, *_CALL.findall(head)}, modules, re.compile(rf"[,; ]({_NAME})={re.escape(lazy[1])}\(\(\)=>")
    )
    return "".join([head, *(body for name, body in modules.items() if name in needed), text[end:]])


def _kept(calls: Iterable[str], modules: Mapping[str, str], traces: set[str]) -> list[str]:
    """The calls that load these traces: each module hands on that of its trace."""
    kept, missing = [], set(traces)
    for call in calls:
        own = _EXPORT.search(modules.get(call.removesuffix("()"), ""))
        trace = _TRACE.search(modules.get(own[1], "")) if own else None
        if trace is not None and trace[1] in traces:
            kept.append(call)
            missing.discard(trace[1])
    if missing:
        raise UnknownBundleError(f"it has no {' and no '.join(sorted(missing))}")
    return kept


def _reached(first: Iterable[str], modules: Mapping[str, str], lazy: re.Pattern[str]) -> set[str]:
    """Names of the modules that are needed, directly or by another one."""
    owners = {name: name for name in modules}
    for name, body in modules.items():
        owners |= dict.fromkeys(lazy.findall(body), name)
    waiting = [owners[name] for name in first if name in owners]
    needed = set(waiting)
    while waiting:
        called = {owners[name] for name in _CALL.findall(modules[waiting.pop()]) if name in owners}
        waiting += called - needed
        needed |= called
    return needed
