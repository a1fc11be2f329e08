"""A disk that fills at random points of a run: no trace, no bug, no half a file; with room again the run goes on.

The disk is a small tmpfs in a mount namespace of the bench's own, which needs no privilege where the system lets users
have namespaces. ``python -m notabug.bench.faults_disk SEED NUMBER POINTS FOLDER`` runs inside and prints what is wrong.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from notabug.bench.faults_setting import PATIENCE, Setting, lay_out, trace

POINTS = 5  # in one folder
SCENES = 4
PAGE = 4096  # bytes: a smaller tmpfs holds nothing
ROOM = 64 << 20  # bytes with which a run has room for everything
FILES = 0.3  # of all points: the disk has room for no further files, not for no further bytes
SMALL_CACHE = 0.5  # of all points: the cache and temporary files are on that disk too
ENDS = (0, 2, 3)  # exit codes: it had room enough, an error of files, results that say so


def why_not() -> str:
    """Why no disk can be filled here, or ""."""
    if not all(shutil.which(program) for program in ("unshare", "mount", "umount")):
        return "the programs unshare and mount are not there"
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        tried = subprocess.run(
            [*_INSIDE, "mount", "-t", "tmpfs", "-o", "size=64k", "none", name], capture_output=True, check=False
        )
    return "" if tried.returncode == 0 else "the system gives users no mount namespaces"


_INSIDE = ("unshare", "--user", "--map-root-user", "--mount")


def take(seed: int, number: int, points: int = POINTS) -> list[str]:
    """Fill the disk at so many points of runs in the folder ``number`` of ``seed``; what is wrong."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as name:
        words = (str(seed), str(number), str(points), str(Path(name).resolve()))
        ended = subprocess.run(
            [*_INSIDE, sys.executable, "-P", "-m", "notabug.bench.faults_disk", *words],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=2 * PATIENCE * (points + 1),
            check=False,
        )
    if ended.returncode:
        return [f"folder {number}, the bench itself failed: {ended.stderr[-300:]}"]
    return [f"folder {number}, {what}" for what in json.loads(ended.stdout)]


def main(seed: int, number: int, points: int, folder: Path) -> list[str]:
    chance = random.Random(f"{seed} disks {number}")  # noqa: S311 - no secret depends on it
    setting = lay_out(folder, [f"scene{index}" for index in range(SCENES)], retries=0)
    disk = folder / "disk"
    disk.mkdir()
    found: list[str] = []
    needs: dict[bool, tuple[int, int]] = {}  # whether the cache is there too: what a run with room enough takes
    for _ in range(points):
        cached = chance.random() < SMALL_CACHE
        by_files = chance.random() < FILES
        if cached not in needs:
            _mount(disk, f"size={ROOM}")
            code, log = _run(setting, disk, cached)
            if code:
                return [f"a run with room enough ended with {code}: {log[-300:]}"]
            seen = os.statvfs(disk)
            needs[cached] = (seen.f_blocks - seen.f_bfree) * seen.f_frsize, seen.f_files - seen.f_ffree
            _system("umount", str(disk))
        taken, files = needs[cached]
        limit = chance.randrange(2, files) if by_files else chance.randrange(PAGE, taken, PAGE)
        _mount(disk, f"size={ROOM},nr_inodes={limit}" if by_files else f"size={limit}")
        what = f"room for {limit} {'files' if by_files else 'bytes'}{', cache on it' if cached else ''}"
        found += [f"{what}: {each}" for each in _filled(setting, disk, cached, by_files)]
        _system("umount", str(disk))
    return found


def _filled(setting: Setting, disk: Path, cached: bool, by_files: bool) -> list[str]:
    """What is wrong with a run on a ``disk`` that fills, and with the same one when there is room again."""
    found = []
    code, log = _run(setting, disk, cached)
    if code not in ENDS:
        found.append(f"exit code {code}: {log[-300:]}")
    if shown := trace(log):
        found.append(shown)
    if broken := setting.broken(disk / "out"):
        found.append(f"half a file: {', '.join(broken)}")
    if left := setting.end_all():
        found.append(left)
    before = {scene: word for scene, word, _ in setting.verdicts(disk / "out")}
    if set(before.values()) - {"pass", "error"}:
        found.append(f"verdicts on a full disk: {before}")
    _system("mount", "-o", f"remount,size={ROOM}{',nr_inodes=100000' if by_files else ''}", str(disk))
    code, log = _run(setting, disk, cached)
    if code:
        found.append(f"with room again it ended with {code}: {log[-300:]}")
    verdicts = Counter(scene for scene, word, _ in setting.verdicts(disk / "out") if word == "pass")
    if verdicts != Counter(setting.names):
        found.append(f"results with room again: {dict(verdicts)}")
    if litter := [path.name for path in (disk / "out").rglob(".*.partial*")]:
        found.append(f"half files are left: {', '.join(litter[:5])}")
    return found


def _run(setting: Setting, disk: Path, cached: bool) -> tuple[int | None, str]:
    """A run into ``disk``; where ``cached``, its cache and its temporary files are there too."""
    more = {}
    if cached:
        more = {"NOTABUG_CACHE": str(disk / "cache"), "TMPDIR": str(disk / "tmp")}
        if not (disk / "tmp").is_dir():
            try:
                (disk / "tmp").mkdir()
            except OSError:  # not even that fits
                more["TMPDIR"] = str(setting.folder / "tmp")
    return setting.run("--jobs", "1", "--out", str(disk / "out"), environment=more)


def _mount(disk: Path, options: str) -> None:
    _system("mount", "-t", "tmpfs", "-o", f"{options},mode=700", "none", str(disk))


def _system(*words: str) -> None:
    subprocess.run(words, check=True, capture_output=True)


if __name__ == "__main__":
    print(json.dumps(main(int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))))
