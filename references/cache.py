"""Where what can be computed again is kept, and the hashes of the code that computes it."""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

import platformdirs


def cache_root() -> Path:
    """The folder of everything notabug can recompute: ``$NOTABUG_CACHE``, or the user's cache folder."""
    return Path(os.environ.get("NOTABUG_CACHE") or platformdirs.user_cache_dir("notabug"))


def source_hash(folder: Path) -> str:
    """A hash of every Python file below ``folder``: part of the key of whatever that code computes."""
    state = hashlib.blake2b(digest_size=8)
    for path in sorted(folder.rglob("*.py")):
        state.update(path.name.encode())
        state.update(path.read_bytes())
    return state.hexdigest()
