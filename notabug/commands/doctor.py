"""The ``doctor`` command: what is installed, what is missing, and how to get it."""

from __future__ import annotations

import json
import os
import platform
import sys
from dataclasses import asdict, dataclass

from rich.table import Table
from rich.text import Text

import notabug
from notabug.adapters.registry import adapters
from notabug.exit_codes import ExitCode
from notabug.runs.progress import console
from notabug.runs.provenance import library_versions
from notabug.scenes_usd.errors import NotabugError


@dataclass(frozen=True, slots=True)
class Check:
    """One thing that was looked at: ``fine`` is None where a lack is no fault."""

    name: str
    fine: bool | None
    says: str


def checks() -> list[Check]:
    """Python, the libraries, then every renderer."""
    found = [Check("python", sys.version_info >= (3, 11), f"{platform.python_version()} at {sys.executable}")]
    for name, version in library_versions().items():
        found.append(Check(name, bool(version), version or "not installed: pip install notabug"))
    found.append(Check("cores", True, str(os.cpu_count())))
    for name, adapter in adapters().items():
        try:
            there = adapter.find()
        except NotabugError as error:
            found.append(Check(name, None, f"{error}; to install: {adapter.install}"))
        else:
            remarks = "".join(f"; {remark}" for remark in there.remarks)
            found.append(Check(name, True, f"{there.version} at {there.where}{remarks}"))
    return found


def command(as_json: bool) -> ExitCode:
    """Print the checks; a renderer that is not there is no error, a broken installation is."""
    found = checks()
    if as_json:
        print(json.dumps({"version": notabug.__version__, "checks": [asdict(each) for each in found]}))
    else:
        shown = Table(box=None, show_header=False, pad_edge=False)
        for each in found:
            glyph, style = {True: ("✓", "green"), False: ("✗", "bold red"), None: ("–", "yellow")}[each.fine]
            shown.add_row(Text(glyph, style=style), Text(each.name), Text(each.says))
        console().print(shown)
    return ExitCode.USAGE if any(each.fine is False for each in found) else ExitCode.OK
