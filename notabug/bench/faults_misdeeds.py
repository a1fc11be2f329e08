"""What a renderer can do wrong, what becomes of it, and whether the other jobs' results are right."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from notabug.bench.faults_setting import Setting, lay_out, trace

MATRIX = {
    # time, memory and processes
    "hangs": ("error", "its time limit"),
    "ignores_sigterm": ("error", "its time limit"),
    "stops_itself": ("error", "its time limit"),
    "stops_its_keeper": ("error", "its time limit"),
    "kills_its_keeper": ("error", "SIGKILL"),
    "kills_its_group": ("error", "SIGKILL"),
    "spins": ("error", "its limit of processor time"),
    "spins_in_children": ("error", "its limit of processor time"),
    "detaches": ("error", "left no picture"),
    "detaches_and_draws": ("pass", ""),
    "detaches_and_hangs": ("error", "its time limit"),
    "overwrites_late": ("pass", ""),
    "breeds": ("pass", ""),
    "leaves_zombies": ("pass", ""),
    "eats_memory": ("error", "its memory limit"),
    "eats_memory_in_children": ("error", "its memory limit"),
    "crashes": ("error", "SIGSEGV"),
    "killed_half_way": ("error", "SIGKILL"),
    "exits_with_3": ("error", "exit code 3"),
    "asks_for_an_answer": ("pass", ""),
    "closes_its_descriptors": ("pass", ""),
    "floods_the_log": ("error", "exit code 1"),
    "prints_escapes": ("error", "exit code 1"),
    # pictures
    "no_image": ("error", "left no picture"),
    "empty_image": ("error", "left no picture"),
    "folder_image": ("error", "left no picture"),
    "fifo_image": ("error", "left no picture"),
    "linked_image": ("error", "a link to another file"),
    "hard_linked_image": ("error", "older than the job"),
    "stale_image": ("error", "older than the job"),
    "image_of_the_future": ("pass", ""),
    "wrong_size": ("error", "the picture is 4 x 4, expected is 32 x 32"),
    "negative_size": ("error", "cannot be read"),
    "truncated": ("error", "damaged or truncated|cannot be read"),
    "runs_on": ("pass", ""),
    "non_finite": ("bug", "NaN or infinite"),
    "enormous_values": ("bug", ""),
    "negative": ("bug", "negative"),
    "swapped_bytes": ("bug", ""),
    "one_channel": ("error", "1 channels"),
    "not_a_picture": ("error", "cannot be read"),
    "huge_header": ("error", "cannot be read"),
    "endless_header": ("error", "cannot be read"),
    "thousands_of_channels": ("error", "1024 channels"),
    "hundreds_of_texts": ("error", "64 compressed texts"),
    "picture_bomb": ("error", "40000 x 40000|cannot be read"),
    # files and folders
    "gigabyte": ("error", "its output limit"),
    "fills_the_disk": ("error", "its output limit"),
    "hides_output": ("error", "its output limit"),
    "promises_output": ("error", "exit code 1|SIGXFSZ"),
    "litters": ("pass", ""),
    "nests": ("error", "its output limit"),
    "odd_names": ("pass", ""),
    "takes_rights_away": ("pass", ""),
    "removes_its_folder": ("error", "replaced a folder"),
    "links_its_folder": ("error", "replaced a folder"),
    "links_the_folder_of_its_picture": ("error", "a link to another file"),
    "folders_in_our_place": ("pass", ""),
    "links_in_our_place": ("pass", ""),
    "forges_its_result": ("bug", "negative"),
    "spoils_its_lock": ("pass", ""),
    "overwrites_its_scene": ("pass", ""),
}
"""Misdeed: the verdict on it, and what its message says."""
LIMITS: dict[str, Any] = {"timeout": 12, "cpu": 1, "memory": "400 MiB", "output": "48 MiB", "retries": 0}
"""Seconds, seconds of processor time, bytes resident and bytes written, of one job."""
GOOD = ("good", "also_good", "good_too")
"""Scenes that are drawn right, before, between and after."""
MOST_LEFT = 32 << 20  # bytes of a run's folder: what filled the disk is gone
_CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")


def with_good(names: Sequence[str]) -> list[str]:
    """``names`` with good ones before, between and after."""
    half = len(names) // 2
    return [GOOD[0], *names[:half], GOOD[1], *names[half:], GOOD[2]]


def wrong(name: str, word: str, message: str) -> str:
    """What is wrong with the verdict ``word`` on the misdeed ``name``, or ""."""
    expected, says = MATRIX.get(name, ("pass", ""))
    if word != expected or not re.search(says, message):
        return f"expected {expected} {says!r}, got {word}: {' '.join(message.split())[:160]}"
    return ""


def take(names: Sequence[str]) -> dict[str, str]:
    """Run a renderer that commits the misdeeds ``names``; what is wrong, by misdeed, or by what it is wrong with."""
    with tempfile.TemporaryDirectory(prefix="notabug-") as folder:
        setting = lay_out(Path(folder).resolve(), with_good(names), **LIMITS)
        return judged(setting, *setting.run("--jobs", "1"))


def judged(setting: Setting, code: int | None, log: str) -> dict[str, str]:
    """What is wrong with a run over misdeeds that ended with ``code`` and printed ``log``."""
    found = setting.verdicts()
    told = {scene: wrong(scene, word, message) for scene, word, message in found}
    told |= {name: "no result, or two" for name in setting.names if [scene for scene, *_ in found].count(name) != 1}
    words = {word for _, word, _ in found}
    expected = 1 if "bug" in words else 3 if "error" in words else 0
    told["exit code"] = "" if code == expected else f"expected {expected}, got {code}"
    told["trace"] = trace(log)
    told["terminal"] = "control characters" if _CONTROLS.search(log) else ""
    told["processes"] = setting.end_all()
    size = sum(path.lstat().st_size for path in setting.out.rglob("*") if path.is_file())
    told["disk"] = "" if size < MOST_LEFT else f"{size} bytes are left"
    written = [
        path.name for folder in setting.pictures.glob("outside-*") for path in folder.rglob("*") if path.is_file()
    ]
    told["outside"] = f"the run wrote {written}" if {name for name in written if not name.startswith("image")} else ""
    return {name: what for name, what in told.items() if what}
