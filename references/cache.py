"""Where what can be computed again is kept, and the hashes of the code that computes it."""

from __future__ import annotations

import hashlib
from pathlib import Path

from notabug.scenes_usd.cache_folder import cache_root as cache_root


def source_hash(folder: Path) -> str:
    """A hash of every Python file below ``folder``: part of the key of whatever that code computes."""
    state = hashlib.blake2b(digest_size=8)
    for path in sorted(folder.rglob("*.py")):
        state.update(path.name.encode())
        state.update(path.read_bytes())
    return state.hexdigest()
