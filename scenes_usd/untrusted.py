"""Scenes from outside the corpus are data of unknown making: what they may refer to, and what reading them may cost.

Two fences. A scene may name only files below its own folder (``fence``). And it is first read in a child process with
limits of processor time and of memory, since nesting without end, arrays without end and prims that double at each
level end OpenUSD's parser or this process before any check could. What one variant, frame or camera shows says nothing
of what another costs, so each look at a scene passes by itself. One that has passed is remembered by the scene's
contents and by the states of the layers that it names.

``NOTABUG_TRUST`` names a folder (or several, as in PATH) whose scenes pass both fences unseen.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import psutil

from notabug.scenes_usd.cache_folder import cache_root
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.fence import TRUST, OutsideError, check_size
from notabug.scenes_usd.look import Look
from notabug.scenes_usd.temporary import temporary_folder

SECONDS = 30  # of processor time in the child
STILL = 60.0  # seconds on the clock in which a child that waits for something has used no processor time
LOOK = 1.0  # seconds from one look at it to the next
MEMORY = 4 << 30  # bytes of address space in the child
TOGETHER = 32  # scenes that one child reads
RULES = "3"  # of the fence: a scene that passed under others is read again


def is_trusted(path: Path) -> bool:
    """Whether ``path``, resolved, is the corpus's or below a folder that ``NOTABUG_TRUST`` names."""
    corpus = Path(__file__).resolve().parent
    named = [Path(each).resolve() for each in os.environ.get(TRUST, "").split(os.pathsep) if each]
    return any(path.is_relative_to(each) for each in (corpus, *named))


def check_looks(looks: Iterable[Look]) -> None:
    """Raise SceneError where reading one of ``looks`` would harm."""
    for error in problems(looks).values():
        raise error


def problems(looks: Iterable[Look]) -> dict[Look, SceneError]:
    """What is wrong with those of ``looks`` that would harm whoever reads them.

    What is not known from before is read by a child: one for many of them, which takes little longer than one for each
    takes to start. Where that goes wrong each is read by a child of its own, which tells the one at fault.
    """
    found: dict[Look, SceneError] = {}
    unknown = []
    for look in dict.fromkeys(looks):
        if is_trusted(look.path):
            continue
        try:
            state, refused = _refused.get(look, (None, None))
            if refused is not None and state == state_of(look.path):
                raise refused
            if not _is_known(look):
                unknown.append(look)
        except SceneError as error:
            found[look] = error
    for start in range(0, len(unknown), TOGETHER):
        part = unknown[start : start + TOGETHER]
        if len(part) == 1 or _read_by_child(part):
            for look in part:
                _read_alone(look)
    for look in unknown:
        state, refused = _refused.get(look, (None, None))
        if refused is not None and state == state_of(look.path):
            found[look] = refused
    return found


State = list[int] | None
_passed: dict[Look, dict[str, State]] = {}  # look, its layers' files, their states
_refused: dict[Look, tuple[State, SceneError]] = {}


def _is_known(look: Look) -> bool:
    """Whether ``look`` passed before, in this process or another, as its file and the layers it names are now."""
    if look in _passed and _are_as(_passed[look]):
        return True
    check_size(look.path)
    try:
        layers = json.loads(_mark(look).read_text(encoding="utf-8"))
        known = _are_as(layers)
    except (OSError, ValueError, AttributeError):
        return False
    if known:
        _passed[look] = layers
    return known


def _are_as(states: dict[str, State]) -> bool:
    """Whether the files of ``states`` are in these states."""
    return all(state_of(Path(name)) == state for name, state in states.items())


def _read_alone(look: Look) -> None:
    state = state_of(look.path)
    if ending := _read_by_child([look]):
        error = SceneError(
            f"reading this file ends its reader: {ending.reason}",
            where=str(look),
            expected=f"{SECONDS} s of processor time and {MEMORY >> 30} GiB to be enough",
            got=ending.state,
            do=f"make it smaller; or set {TRUST} to its folder where you trust it",
        )
        _refused[look] = (state, error)


@dataclass(frozen=True, slots=True)
class _Ending:
    """How a child ended that did not read its scenes."""

    state: str
    reason: str


def _read_by_child(looks: Sequence[Look]) -> _Ending | None:
    """What went wrong where a child had ``looks``, or None: then they are remembered."""
    before = [(state_of(look.path), _mark(look)) for look in looks]
    child_of = [sys.executable, "-P", "-m", "notabug.scenes_usd.untrusted_child", str(os.getpid())]
    command = [*child_of, *(look.as_text() for look in looks)]
    with (
        tempfile.TemporaryFile() as told,
        tempfile.TemporaryFile() as log,
        temporary_folder() as own,
    ):
        child = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=told,
            stderr=log,
            cwd=looks[0].path.parent,
            env={**os.environ, "TMPDIR": str(own)},
        )
        try:
            ended = _wait(child)
        finally:
            child.kill()
            child.wait()
        told.seek(0)
        log.seek(0)
        lines = told.read().decode("utf-8", "replace").splitlines()
        if not ended:
            return _Ending(f"no processor time used in {STILL:g} s", "it waits for something without end")
        if child.returncode or len(lines) != len(looks):
            return _ending(child.returncode, log.read(1 << 20))
    for look, (state, mark), line in zip(looks, before, lines, strict=True):
        said = json.loads(line)
        if said["outside"] is not None:
            what, where, expected, got, do = said["outside"]
            _refused[look] = (state, OutsideError(what, where=where, expected=expected, got=got, do=do))
            continue
        # of a scene that was refused for a layer the others were not looked at
        _passed[look] = {str(look.path): state} if said["layers"] is None else said["layers"]
        if said["layers"] is not None:
            with contextlib.suppress(OSError):  # a full disk costs time: it is read by a child again
                mark.parent.mkdir(parents=True, exist_ok=True)
                mark.write_text(json.dumps(said["layers"]), encoding="utf-8")
    return None


def _wait(child: subprocess.Popen[bytes]) -> bool:
    """Wait for ``child``, whose processor time has a limit: on a busy machine that may take any time on the clock.

    False where it stands still: it sleeps, and has used no processor time for STILL seconds.
    """
    watched = psutil.Process(child.pid)
    used, still = -1.0, 0.0
    while True:
        try:
            child.wait(LOOK)
            return True
        except subprocess.TimeoutExpired:
            with contextlib.suppress(psutil.Error):
                now = sum(watched.cpu_times()[:2])
                waits = watched.status() in (psutil.STATUS_SLEEPING, psutil.STATUS_DISK_SLEEP, psutil.STATUS_STOPPED)
                still = still + LOOK if waits and now == used else 0.0
                used = now
            if still >= STILL:
                return False


def _ending(code: int, log: bytes) -> _Ending:
    """What the exit state of a child says, without a word from its log, which may quote any file."""
    if code == -getattr(signal, "SIGXCPU", 0):
        return _Ending(f"stopped after {SECONDS} s of processor time", "it takes too long")
    if b"MemoryError" in log or b"bad_alloc" in log:
        return _Ending(f"exit state {code}, out of memory", "it is too large")
    return _Ending(f"exit state {code}", "it is nested too deep, or too large")


def state_of(path: Path) -> State:
    """What tells one state of a file from another; None where it is not there."""
    try:
        seen = path.stat()
    except OSError:
        return None
    return [seen.st_size, seen.st_mtime_ns, seen.st_dev, seen.st_ino]


def _mark(look: Look) -> Path:
    """The file in the cache that holds the states of the layers with which ``look``, as its file is now, has passed."""
    state: Any = hashlib.blake2b(look.path.read_bytes(), digest_size=16)
    state.update(f"{RULES} {look.as_text()}".encode())
    return cache_root() / "scenes" / str(state.hexdigest())
