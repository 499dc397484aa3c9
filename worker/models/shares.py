"""Shares among the results of a model, which people may read in per cent."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from sprag_study.worker.models.parameters import general_path

if TYPE_CHECKING:
    from sprag_study.engine.catalogue import ResultInfo


class Share(str):
    """The unit of a share: "1" for programs, and told from other numbers without a unit where people read it."""

    __slots__ = ()


SHARE: Final = Share("1")


@lru_cache(maxsize=256)
def with_shares(infos: tuple[ResultInfo, ...], names: tuple[str, ...]) -> tuple[ResultInfo, ...]:
    """Results with the unit `SHARE` for those of the names, which have N and K for indices, and their half widths."""

    def is_share(name: str) -> bool:
        own = name.removesuffix(".half_width")
        return own in names or general_path(own) in names

    return tuple(replace(info, unit=SHARE) if is_share(info.name) else info for info in infos)
