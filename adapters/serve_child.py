"""A process that stays for a script that draws: ``python -P serve_child.py SCRIPT``; ``kept.py`` says how it is told.

SCRIPT is a file beside this one whose function ``main`` draws the job in a folder; ``child_job.py`` says what is there.
What takes long to start, the renderer's packages and its context, is started once for all jobs of a run.
"""

from __future__ import annotations

import importlib.util
import json
import os
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from types import ModuleType


def serve(script: Path) -> None:
    """Answer that it is ready, then draw the folder of each line of the input, and answer."""
    draw = _loaded(script).main
    _answer("ready")
    for line in sys.stdin:
        try:
            draw(Path(line.rstrip("\n")))
            _answer("done")
        except (Exception, SystemExit) as error:  # a scene that cannot be drawn must not end the renderer
            if not isinstance(error, SystemExit):  # which a script raises to say why
                traceback.print_exc()
            _answer(f"failed {json.dumps(str(error))}")


def _loaded(script: Path) -> ModuleType:
    place = importlib.util.spec_from_file_location(script.stem, script)
    assert place is not None
    assert place.loader is not None
    module = importlib.util.module_from_spec(place)
    sys.modules[script.stem] = module
    place.loader.exec_module(module)
    return module


def _answer(said: str) -> None:
    """Begin a new line: what a renderer printed may have no end."""
    print(f"\n{os.environ.get('NOTABUG_JOB', '')} {said}", flush=True)


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
    sys.stdout.flush()
    os._exit(0)  # taking a device down may crash after the pictures have been written, and Blender takes seconds
