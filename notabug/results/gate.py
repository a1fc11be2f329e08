"""The gate: compares every result with what is expected of it and says which ones fail a build."""

from __future__ import annotations

import datetime
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from notabug.exit_codes import ExitCode
from notabug.results import expect_file
from notabug.results.document import GateSaid
from notabug.results.expectation import WORSE, Entry, State, against_entry, against_table, leaves_upwards, unused
from notabug.results.record import Result
from notabug.runs.provenance import models_version

NO_REFERENCE = "reference"  # the trigger of an error that is the reference's, no matter what the renderer did
OF_FILES = "files"  # the trigger of an error that is the disk's, or of the rights to a folder
NOT_CALIBRATED = "calibration"  # the trigger of an error that the renderer's card makes: nothing of it is judged
NO_SCENE = "scene"  # the trigger of an error that is the scene's: no renderer was asked

FailOn = Literal["any", "visible"]


@dataclass(frozen=True, slots=True)
class Gate:
    """What a team has accepted (``entries``, over what the scenes' own tables state) and what fails.

    ``fail_on``: ``any`` bug, or only a ``visible`` one.
    """

    entries: tuple[Entry, ...] = ()
    file: str = ""
    fail_on: FailOn = "any"
    models: str = field(default_factory=models_version)
    today: datetime.date = field(default_factory=lambda: datetime.datetime.now(datetime.UTC).date())

    @classmethod
    def load(cls, path: Path | None, fail_on: FailOn = "any") -> Gate:
        """The gate by the file at ``path``; None: ``notabug.expect.toml`` of this folder, where there is one."""
        if path is None:
            path = Path(expect_file.NAME)
            if not path.is_file():
                return cls(fail_on=fail_on)
        return cls(expect_file.read(path), str(path), fail_on)

    def judged(self, result: Result) -> Result:
        """``result`` with its state, the reason why it was accepted, and whether it fails."""
        entry = next((each for each in self.entries if each.key == _key(result)), None)
        if entry is None:
            state = against_table(result, result.expected)
            return replace(result, state=state, because="", fails=self._fails(result, state, tight=False))
        state = against_entry(result, entry, self.models, self.today)
        worse = state in WORSE and (state != "models changed" or leaves_upwards(result, entry))
        fails = worse and self._fails(result, state, tight=True)
        expected = f"{entry.verdict}: {entry.name}" if entry.name else entry.verdict
        return replace(result, expected=expected, state=state, because=entry.because, fails=fails)

    def _fails(self, result: Result, state: State, *, tight: bool) -> bool:
        """Whether ``result`` fails in ``state``; ``tight``: it has an entry, which limitations must keep to as well."""
        word = result.verdict.word
        if state not in WORSE:
            return word == "error" and state != "as expected"
        if word not in ("bug", "limitation"):
            return word == "error" or tight
        if word == "limitation" and not tight:
            return False
        found = [finding for finding in result.verdict.findings if finding.kind == word]
        return self.fail_on == "any" or not found or any(each.visible for each in found)

    def document(self, results: Sequence[Result]) -> GateSaid:
        """The ``gate`` entry of ``run.json``."""
        return {
            "file": self.file,
            "fail_on": self.fail_on,
            "models": self.models,
            "unused": [
                {"renderer": renderer, "scene": scene, "variant": variant}
                for renderer, scene, variant in (entry.key for entry in unused(self.entries, results))
            ],
        }


def code_of(results: Sequence[Result]) -> ExitCode:
    """A bug outweighs an error, a renderer's that of a reference, and that one a scene's; what is accepted is none."""
    failing = [result.verdict for result in results if result.fails]
    if any(each.word != "error" for each in failing):
        return ExitCode.BUG
    if any(not {NO_REFERENCE, NO_SCENE}.intersection(each.triggers) for each in failing):
        return ExitCode.RENDERER
    if any(NO_REFERENCE in each.triggers for each in failing):
        return ExitCode.REFERENCE
    return ExitCode.USAGE if failing else ExitCode.OK


def _key(result: Result) -> tuple[str, str, str]:
    return (result.renderer, result.scene, result.variant)
