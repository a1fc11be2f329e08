"""What the worker processes of a run are forked from: importing this loads all that a job needs, once for all of them.

Nothing here may start a thread, whose locks a fork would leave locked: no stage is opened, nothing is drawn.
"""

from __future__ import annotations

import OpenImageIO
import psutil

from notabug.adapters import configured, povray
from notabug.references.models import model
from notabug.runs import first_card, job_files
from notabug.runs import judge_files as outcome
from notabug.scenes_usd import reader_stage

__all__ = ["OpenImageIO", "configured", "first_card", "job_files", "outcome", "povray", "psutil", "reader_stage"]

model.load()
job_files.made_by()
