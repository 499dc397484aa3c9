"""The office that makes a document: its name, its templates and logo, and its time zone."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Final, Self
from zoneinfo import ZoneInfo

from sprag_study.service.languages import date_format

if TYPE_CHECKING:
    from sprag_study.service.settings import Settings

#: Files that may be the logo, and their media types.
_LOGOS: Final = (("logo.svg", "image/svg+xml"), ("logo.png", "image/png"))


@dataclass(frozen=True, slots=True)
class Office:
    """An office; ``folder`` has its templates and its logo, "" where it has none of its own."""

    name: str = ""
    folder: str = ""
    zone: str = "UTC"

    @classmethod
    def of(cls, settings: Settings) -> Self:
        """That of a service or of a command."""
        return cls(settings.report_office, settings.report_folder, settings.zone)

    @property
    def place(self) -> Path | None:
        """Its folder."""
        return Path(self.folder) if self.folder else None

    @property
    def logo(self) -> tuple[str, bytes] | None:
        """Media type and picture of its logo; None where there is none."""
        place = self.place
        if place is None:
            return None
        return next(((kind, (place / name).read_bytes()) for name, kind in _LOGOS if (place / name).is_file()), None)

    def today(self) -> str:
        """The date there, as the language writes it."""
        return datetime.now(UTC).astimezone(ZoneInfo(self.zone)).strftime(date_format())

    def moment(self, time: datetime) -> str:
        """A time on its clock, the date as the language writes it."""
        return time.astimezone(ZoneInfo(self.zone)).strftime(f"{date_format()} %H:%M %Z")
