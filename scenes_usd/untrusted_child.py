"""The process in which scenes of unknown making are read first.

``python -m notabug.scenes_usd.untrusted_child FILE...`` ends with 0 where each scene was read or refused by name.
Anything else, a crash, a signal or no end, is the answer. For each scene it prints a line of JSON: ``layers``, the list
of its layers' files or null where it was refused for one of them, and ``outside``, the parts of the message where it
would open a file outside of its folder.

Where the system can confine it (Landlock), it opens no file but below the scenes' folders and where Python and its
libraries are, and writes only below the temporary folder that it was given, TMPDIR.
"""

from __future__ import annotations

import contextlib
import json
import os
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.fence import OutsideError, layers_of
from notabug.scenes_usd.landlock import confine, programs
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.untrusted import MEMORY, SECONDS
from notabug.scenes_usd.view import View


def main(paths: Sequence[Path]) -> None:
    with contextlib.suppress(ImportError, ValueError):  # not everywhere
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    confine(programs() | {path.parent for path in paths}, [Path(tempfile.gettempdir()), Path(os.devnull)])
    for path in paths:
        sys.stdout.write(json.dumps(_tried(path)) + "\n")
        sys.stdout.flush()


def _tried(path: Path) -> dict[str, object]:
    layers, outside = None, None
    try:
        layers = [str(file) for file, _ in layers_of(path)]
        read_stage(path, path.stem, {}, View(quick=True))
    except NotabugError as error:  # the process that asks will say the same, but of files outside
        for part in getattr(error, "errors", (error,)):
            if isinstance(part, OutsideError):
                layers, outside = None, [part.what, part.where, part.expected, part.got, part.do]
                break
    return {"layers": layers, "outside": outside}


if __name__ == "__main__":
    main([Path(each) for each in sys.argv[1:]])
