"""``python -m notabug.scenes_usd.authoring [--check]``: write the whole corpus, or compare it.

A scene is one module here with a function ``files() -> dict[path below scenes_usd, bytes]``.
"""

from __future__ import annotations

import argparse
import importlib
import pkgutil
import sys
from pathlib import Path

import notabug.scenes_usd.authoring as authoring

CORPUS = Path(__file__).resolve().parent.parent


def all_files() -> dict[str, bytes]:
    """Every authored file by its path below scenes_usd."""
    found: dict[str, bytes] = {}
    for module in pkgutil.iter_modules(authoring.__path__):
        if module.name != "__main__":
            files = getattr(importlib.import_module(f"{authoring.__name__}.{module.name}"), "files", None)
            found |= files() if files else {}
    return dict(sorted(found.items()))


def differing(folder: Path = CORPUS) -> list[str]:
    """The paths whose file below ``folder`` is missing or has other bytes than the script would write."""
    return [
        name
        for name, data in all_files().items()
        if not (folder / name).is_file() or (folder / name).read_bytes() != data
    ]


def main(arguments: list[str] | None = None) -> int:
    """0: done, or all identical; 1: ``--check`` found a difference."""
    parser = argparse.ArgumentParser(prog="python -m notabug.scenes_usd.authoring", description="Write the corpus.")
    parser.add_argument("--check", action="store_true", help="write nothing; exit 1 where a file is not as authored")
    changed = differing()
    if parser.parse_args(arguments).check:
        sys.stdout.write("".join(f"{name}: not as authored\n" for name in changed) or "identical\n")
        return 1 if changed else 0
    written = all_files()
    for name in changed:
        path = CORPUS / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(written[name])
        sys.stdout.write(f"{name}: written\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
