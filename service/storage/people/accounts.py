"""Accounts at the OpenID provider, as the login and the database know them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Account:
    """An account at the OpenID provider.

    Attributes
    ----------
    issuer : str
    subject : str
        SHA-256 of issuer and subject, 64 hexadecimal digits.
    name : str
        The name of a user that its claim gives.
    """

    issuer: str
    subject: str
    name: str

    @property
    def label(self) -> str:
        """The account in the log."""
        return f"{self.name!r} (account {self.subject[:12]})"
