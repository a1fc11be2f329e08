"""The renderer: ``program.py scene.json image.pfm pictures``. It misbehaves as the scene is called.

Scenes without a misdeed of their name, the card among them, are copied from ``pictures``. What it starts leaves a note
there with its process's number. PAUSE gives the seconds that a picture takes. Nothing but the standard library is
imported, and little of it, for this starts with every job.
"""

from __future__ import annotations

import os
import sys
import time

sys.path.append(os.path.abspath(os.path.join(os.path.dirname(__file__), *[os.pardir] * 3)))  # notabug's own folder

from notabug.bench.misbehaving import files, images, processes
from notabug.bench.misbehaving.job import DEEDS, draw, name, pictures

__all__ = ["files", "images", "processes"]  # importing them fills DEEDS

with open(f"{pictures}/calls.txt", "a", encoding="utf-8") as calls:
    calls.write(name + "\n")
time.sleep(float(os.environ.get("PAUSE", "0")))
DEEDS.get(name, draw)()
