"""The process in which scenes of unknown making are read first.

``python -m notabug.scenes_usd.untrusted_child FILE...`` ends with 0 where each scene was read or refused by name: the
process that asks will then do the same. Anything else, a crash, a signal or no end, is the answer. For each scene it
prints a line, a JSON list of its layers, or null where it was refused for one of them.
"""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.untrusted import MEMORY, SECONDS, layers_of


def main(paths: Sequence[Path]) -> None:
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for path in paths:
        layers = None
        with contextlib.suppress(NotabugError):
            layers = [str(file) for file, _ in layers_of(path)]
            from notabug.scenes_usd.reader_stage import read_stage
            from notabug.scenes_usd.reading import View

            read_stage(path, path.stem, {}, View(quick=True))
        sys.stdout.write(json.dumps(layers) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main([Path(each) for each in sys.argv[1:]])
