"""What judged: versions of notabug and its libraries, and a fingerprint of the code so that no stale result is kept."""

from __future__ import annotations

import hashlib
import platform
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import notabug

LIBRARIES = ("numpy", "scipy", "numba", "OpenImageIO", "usd-core", "flip-evaluator", "colour-science", "scikit-image")


@cache
def library_versions() -> dict[str, str]:
    """Version by distribution name; "" where it is not installed."""
    return {name: _version(name) for name in LIBRARIES}


def tool() -> dict[str, Any]:
    """The ``tool`` entry of ``run.json``."""
    return {
        "name": "notabug",
        "version": notabug.__version__,
        "code": fingerprint("scenes_usd", "references", "adapters", "metrics"),
        "python": platform.python_version(),
        "platform": platform.platform(terse=True),
        "libraries": library_versions(),
    }


@cache
def fingerprint(*floors: str) -> str:
    """A hash of the Python sources of ``floors``: a change of the judge's code must not be hidden by a resumed run."""
    state = hashlib.blake2b(digest_size=8)
    root = Path(notabug.__file__).parent
    for floor in floors:
        for path in sorted((root / floor).rglob("*.py")):
            state.update(str(path.relative_to(root)).encode())
            state.update(path.read_bytes())
    return state.hexdigest()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
