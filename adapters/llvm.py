"""Which LLVM library Mitsuba's ``llvm`` variants may load.

Dr.Jit loads the first library it finds. LLVM 15 and 16 then abort the whole process (``LLVM ERROR: Cannot select:
fminimum``) and 14 is refused; 19 works. So the library is chosen here, by the version in its name, and named to Dr.Jit
through ``DRJIT_LIBLLVM_PATH``; one whose version cannot be told is not taken.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

LEAST = 19
VARIABLE = "DRJIT_LIBLLVM_PATH"
_FOLDERS = ("/usr/lib", "/usr/lib64", "/usr/local/lib", "/opt/homebrew/opt/llvm/lib")
_PATTERNS = ("libLLVM*.so*", "*-linux-gnu/libLLVM*.so*", "llvm-*/lib/libLLVM*.so*", "llvm*/lib64/libLLVM*.so*")
_NAME = re.compile(r"libLLVM(?:-(\d+)[\d.]*)?\.so(?:\.(\d+)[\d.]*)?$")
_FOLDER = re.compile(r"llvm-?(\d+)$")


@dataclass(frozen=True, slots=True)
class Library:
    """``path`` of a library to be used, or None with the reason in ``remark``."""

    path: Path | None
    remark: str = ""


def version(path: Path) -> int:
    """The major version that the name of the library ``path`` states, or 0.

    >>> [version(Path(name)) for name in ("libLLVM-15.so.1", "libLLVM.so.19.1", "/usr/lib/llvm-14/lib/libLLVM.so", "x")]
    [15, 19, 14, 0]
    """
    name = _NAME.match(path.name)
    if name is None:
        return 0
    if stated := name[1] or name[2]:
        return int(stated)
    folders = (_FOLDER.match(parent.name) for parent in path.parents)
    return next((int(folder[1]) for folder in folders if folder), 0)


def choose(candidates: Iterable[Path]) -> Path | None:
    """The lowest version from LEAST up: it is the nearest to the one that was measured."""
    able = sorted(
        (version(candidate), len(candidate.name), str(candidate))
        for candidate in candidates
        if version(candidate) >= LEAST
    )
    return Path(able[0][2]) if able else None


def find_library(environment: Mapping[str, str] = os.environ) -> Library:
    """The library to name to Dr.Jit: the user's choice in DRJIT_LIBLLVM_PATH where it is able, else one installed."""
    remark = ""
    if chosen := environment.get(VARIABLE, ""):
        path = Path(chosen)
        if path.is_file() and max(version(path), version(path.resolve())) >= LEAST:
            return Library(path)
        remark = f"{VARIABLE}={chosen} is not an LLVM >= {LEAST} and is left out; "
    found = choose(path for folder in _FOLDERS for pattern in _PATTERNS for path in Path(folder).glob(pattern))
    return Library(found, remark + ("" if found else f"no LLVM >= {LEAST}"))
