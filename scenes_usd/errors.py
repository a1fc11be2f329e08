"""The root of the error tree: every error says what, where, expected, got, and what to do next."""

from __future__ import annotations

from notabug.scenes_usd.opinion import Opinion


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
    """A scene that breaks the contract: names the prim path and the attribute.

    ``mends`` are opinions which, in a layer over the scene, would take it into the contract.
    """

    mends: tuple[Opinion, ...] = ()


class ManyFaultsError(SceneError):
    """All that takes a scene out of the contract, ``errors``: two of them at least."""

    def __init__(self, errors: tuple[SceneError, ...]) -> None:
        self.errors = errors
        first = errors[0]
        super().__init__(first.what, where=first.where, expected=first.expected, got=first.got, do=first.do)
        self.args = (errors,)

    def __str__(self) -> str:
        more = len(self.errors) - 1
        return f"{self.errors[0]} (and {more} more that notabug check lists)"


class SelectionError(NotabugError):
    """A scene, variant or renderer was asked for that does not exist."""
