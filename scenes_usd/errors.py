"""The root of the error tree: every error says what, where, expected, got, and what to do next."""

from __future__ import annotations

import errno
import shlex
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from notabug.scenes_usd.opinion import Opinion

if TYPE_CHECKING:
    from notabug.scenes_usd.view import View


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


@dataclass(frozen=True, slots=True)
class Asked:
    """A scene as a user named it, and the choice of its picture."""

    source: str
    variants: Mapping[str, str]
    view: View

    def named(self, text: str) -> str:
        """``text`` with the scene's own name in the place of the word SCENE of an advice."""
        return text.replace("adapt SCENE ", f"adapt {shlex.quote(self.source)} ")


class SceneError(NotabugError):
    """A scene that breaks the contract: names the prim path and the attribute.

    ``mends`` are opinions which, in a layer over the scene, would take it into the contract; ``asked`` what was to be
    read, where a user named it.
    """

    mends: tuple[Opinion, ...] = ()
    asked: Asked | None = None


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


class FileError(NotabugError):
    """The system refused to read or write a file or a folder."""

    @classmethod
    def of(cls, error: OSError, *, where: str = "", do: str = "") -> FileError:
        """What ``error`` says, where it happened, and what a user can do about it."""
        place = where or str(error.filename2 or error.filename or "")
        advice = do or _ADVICE.get(error.errno or 0, "check the path, its permissions and the room on the disk")
        return cls("cannot read or write", where=place, got=error.strerror or str(error), do=advice)


_ADVICE = {
    errno.ENOSPC: "make room on the disk",
    errno.EDQUOT: "make room in the quota",
    errno.EFBIG: "raise the limit of a file's size (ulimit -f)",
    errno.EMFILE: "raise the limit of open files (ulimit -n)",
    errno.EROFS: "choose a folder that can be written to",
}
# What the system says of files, folders and their room. Any other OSError, a refused connection say, is a defect here.
_OF_FILES = frozenset(
    {*_ADVICE, errno.EACCES, errno.EPERM, errno.ENOENT, errno.EEXIST, errno.ENOTDIR, errno.EISDIR, errno.ENOTEMPTY}
    | {errno.ENAMETOOLONG, errno.ELOOP, errno.ENFILE, errno.EIO, errno.ESTALE, errno.EXDEV, errno.ETXTBSY, errno.ENXIO}
)


def is_of_files(error: BaseException) -> bool:
    """Whether ``error`` is the system's word on a file: a user can act on it, and it is no defect of notabug."""
    return isinstance(error, OSError) and error.errno in _OF_FILES
