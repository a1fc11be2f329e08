"""The root of the error tree: every error says what, where, expected, got, and what to do next."""

from __future__ import annotations


class NotabugError(Exception):
    """An error a user can act on.

    Parameters are the parts of the message; empty ones are left out:
    ``where: what; expected ..., got ...; do next``.
    """

    def __init__(self, what: str, *, where: str = "", expected: str = "", got: str = "", do: str = "") -> None:
        self.what, self.where, self.expected, self.got, self.do = what, where, expected, got, do
        found = ", ".join(part for part in (expected and f"expected {expected}", got and f"got {got}") if part)
        message = "; ".join(part for part in (what, found, do) if part)
        super().__init__(f"{where}: {message}" if where else message)


class SceneError(NotabugError):
    """A scene that breaks the contract: names the prim path and the attribute."""


class SelectionError(NotabugError):
    """A scene, variant or renderer was asked for that does not exist."""
