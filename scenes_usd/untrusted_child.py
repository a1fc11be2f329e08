"""The process in which a scene of unknown making is read first: ``python -m notabug.scenes_usd.untrusted_child FILE``.

It ends with 0 where the scene was read or refused by name: the process that asks will then do the same. Anything else,
a crash, a signal or no end, is the answer.
"""

from __future__ import annotations

import contextlib
import sys
from pathlib import Path

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.untrusted import MEMORY, SECONDS, check_layers


def main(path: Path) -> None:
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    with contextlib.suppress(NotabugError):
        check_layers(path)
        from notabug.scenes_usd.reader_stage import read_stage

        read_stage(path, path.stem, {})


if __name__ == "__main__":
    main(Path(sys.argv[1]))
