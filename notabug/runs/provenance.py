"""What judged: versions of notabug and its libraries, and a fingerprint of the code so that no stale result is kept."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import notabug
from notabug.references import _native
from notabug.results.document import ToolSaid

LIBRARIES = ("numpy", "scipy", "OpenImageIO", "usd-core", "flip-evaluator", "scikit-image")

MADE_OF = (".py", ".usda")  # what scenes, models and the judge are written in


@cache
def library_versions() -> dict[str, str]:
    """Version by distribution name; "" where it is not installed."""
    return {name: _version(name) for name in LIBRARIES}


def tool() -> ToolSaid:
    """The ``tool`` entry of ``run.json``."""
    return {
        "name": "notabug",
        "version": notabug.__version__,
        "models": models_version(),
        "code": fingerprint("scenes_usd", "references", "adapters", "metrics"),
        "python": platform.python_version(),
        "platform": platform.platform(terse=True),
        "libraries": library_versions(),
    }


def models_version() -> str:
    """What a verdict depends on besides the renderer, as ``0.1.0+hash``: scenes, models, our adapters and the judge."""
    return (
        f"{notabug.__version__}+{fingerprint('scenes_usd', 'references', 'adapters', 'metrics', suffixes=MADE_OF)[:8]}"
    )


@cache
def fingerprint(*floors: str, suffixes: tuple[str, ...] = (".py",)) -> str:
    """A hash of the sources of ``floors``: a change of the judge's code must not be hidden by a resumed run."""
    state = hashlib.blake2b(digest_size=8)
    root = Path(notabug.__file__).parent
    for floor in floors:
        for path in sorted(each for each in (root / floor).rglob("*") if each.suffix in suffixes):
            state.update(str(path.relative_to(root)).encode())
            state.update(path.read_bytes())
    if "references" in floors:
        state.update(_native.SOURCES.encode())
    return state.hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
