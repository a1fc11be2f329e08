"""The exit codes of every command, one sentence each, and which error ends in which."""

from __future__ import annotations

from enum import IntEnum


class ExitCode(IntEnum):
    """What the shell gets; where several apply the order is: bug, renderer error, the rest."""

    OK = 0  # Nothing is worse than what is accepted.
    BUG = 1  # At least one picture holds a bug that nobody has accepted.
    USAGE = 2  # The command, a scene or a picture was not usable; nothing was judged for it.
    RENDERER = 3  # A renderer failed, did not pass calibration, or is required and not installed; a cluster was lost.
    REFERENCE = 4  # A reference is missing, holds NaN or Inf, or does not match its scene.
    NOTHING = 5  # The selection holds no job: no scene matches, or no renderer is installed.
    INTERNAL = 70  # A defect of notabug itself (EX_SOFTWARE of sysexits.h): it says nothing of any picture.


# By name, so that the front door starts without importing the floors that define them.
_BY_ERROR = {
    "NothingSelectedError": ExitCode.NOTHING,
    "RendererError": ExitCode.RENDERER,
    "ClusterLostError": ExitCode.RENDERER,
    "RendererMissingError": ExitCode.RENDERER,
    "ReferenceMissingError": ExitCode.REFERENCE,
    "ReferenceNotFiniteError": ExitCode.REFERENCE,
}


def exit_code(error: BaseException) -> ExitCode:
    """The exit code for ``error``: that of the nearest class in its ancestry that has one, else USAGE."""
    return next(
        (_BY_ERROR[each.__name__] for each in type(error).__mro__ if each.__name__ in _BY_ERROR), ExitCode.USAGE
    )
