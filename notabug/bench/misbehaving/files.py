"""Misdeeds with files and folders: too many, too large, in the place of ours, or ours taken away."""

from __future__ import annotations

import json
import os
import shutil
import time

from notabug.bench.misbehaving.job import (
    MIB,
    deed,
    draw,
    grey,
    image,
    job,
    name,
    own,
    pictures,
    put,
    renders,
    scene,
    write,
)


@deed
def gigabyte() -> None:
    with open(image, "wb") as out:
        for _ in range(1024):
            out.write(bytes(MIB))


@deed
def fills_the_disk() -> None:
    for number in range(1024):
        put(bytes(MIB), f"file{number}")
        time.sleep(0.01)


@deed
def hides_output() -> None:
    """As above, in folders of folders."""
    for number in range(1024):
        inner = "/".join(str(number)[: digits + 1] for digits in range(len(str(number))))
        os.makedirs(inner, exist_ok=True)
        put(bytes(MIB), f"{inner}/file")
        time.sleep(0.01)


@deed
def promises_output() -> None:
    """A file of a tebibyte, none of which is there yet."""
    with open("sparse", "wb") as out:
        out.truncate(1 << 40)
    draw()


@deed
def litters() -> None:
    for number in range(3000):
        put(b"", f"litter{number}")
    draw()


@deed
def nests() -> None:
    draw()
    for _ in range(400):
        os.mkdir("in")
        os.chdir("in")


@deed
def odd_names() -> None:
    for odd in (b"a\nb", b"\x1b]0;title\x07", b"\xff\xfe", b"x" * 255, b"-rf", b" ", b"<script>"):
        put(b"x", os.fsdecode(os.fsencode(renders) + b"/" + odd))
    draw()


@deed
def takes_rights_away() -> None:
    draw()
    os.makedirs(f"{renders}/closed/in")
    os.chmod(f"{renders}/closed", 0)


@deed
def removes_its_folder() -> None:
    shutil.rmtree(renders)


@deed
def links_its_folder() -> None:
    """The folder of the run becomes a link to one outside, into which it draws."""
    shutil.rmtree(renders)
    os.makedirs(f"{pictures}/outside-run")
    os.symlink(f"{pictures}/outside-run", renders)
    os.makedirs(own)
    draw()


@deed
def links_the_folder_of_its_picture() -> None:
    shutil.rmtree(own)
    os.makedirs(f"{pictures}/outside-picture")
    os.symlink(f"{pictures}/outside-picture", own)
    draw()


@deed
def folders_in_our_place() -> None:
    for ours in ("log.txt", "result.json", "renders.json", "mean.exr", "nearest.exr", "reference.exr"):
        os.makedirs(f"{job}/{ours}/in")
    draw()


@deed
def links_in_our_place() -> None:
    """What notabug will write is to go over a file outside."""
    for ours in ("log.txt", "result.json", "renders.json", "mean.exr"):
        os.symlink(f"{pictures}/good.pfm", f"{job}/{ours}")
    draw()


@deed
def forges_its_result() -> None:
    verdict = {"scene": name, "verdict": "pass", "message": "", "findings": []}
    put(json.dumps({"key": "", "result": verdict}).encode(), f"{job}/result.json")
    write([*grey[:-1], -1.0])


@deed
def spoils_its_lock() -> None:
    os.unlink(f"{job}/.job.lock")
    os.mkdir(f"{job}/.job.lock")
    draw()


@deed
def overwrites_its_scene() -> None:
    put(b"{}", scene)
    draw()
