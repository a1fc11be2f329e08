"""A renderer that misbehaves as the scene is called: ``misbehaving.py scene.json image.pfm pictures``.

Scenes without a misdeed of their name, the card among them, are copied from ``pictures``. What it starts leaves a note
there with its process's number. PAUSE gives the seconds that a picture takes. Nothing but the standard library is
imported, and little of it, for this starts with every job.
"""

from __future__ import annotations

import array
import json
import os
import shutil
import signal
import struct
import subprocess
import sys
import time
import zlib
from collections.abc import Callable, Iterable

HOUR = 3600.0
MIB = 1 << 20

scene, image, pictures = sys.argv[1:4]
with open(scene, encoding="utf-8") as file:
    said = json.load(file)
name, width, height = said["scene"].replace("/", "-"), said["width"], said["height"]
grey = [0.25] * (3 * width * height)
own = os.path.dirname(os.path.abspath(image))  # the folder of the picture alone
renders = os.path.dirname(os.getcwd())  # the folder above the one in which it works
job = os.path.dirname(renders)

Deed = Callable[[], None]
DEEDS: dict[str, Deed] = {}


def deed(does: Deed) -> Deed:
    """Have ``does`` done for scenes of its name."""
    DEEDS[does.__name__] = does
    return does


def leave(kind: str, pid: int) -> None:
    with open(f"{pictures}/{kind}-{pid}.pid", "w", encoding="utf-8") as note:
        note.write(name)


def write(values: Iterable[float], size: tuple[int, int] | None = None, channels: int = 3, cut: int = 0) -> None:
    wide, high = size or (width, height)
    data = f"{'PF' if channels == 3 else 'Pf'}\n{wide} {high}\n-1.0\n".encode() + array.array("f", values).tobytes()
    put(data[: len(data) - cut])


def put(data: bytes, path: str = "") -> None:
    with open(path or image, "wb") as out:
        out.write(data)


def draw() -> None:
    shutil.copyfile(f"{pictures}/{name}.pfm", image)


def detach(then: Deed) -> None:
    """A daemon: two forks and a session of its own; it does ``then``."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            leave("daemon", os.getpid())
            then()
        os._exit(0)
    os.wait()


def child(then: Deed) -> None:
    """A child that is not waited for; it does ``then``."""
    if os.fork() == 0:
        leave("child", os.getpid())
        then()
        os._exit(0)


def sleep() -> None:
    time.sleep(HOUR)


def spin() -> None:
    while True:
        pass


def hoard(most: int = 1 << 40) -> None:
    kept: list[bytearray] = []
    while 8 * MIB * len(kept) < most:
        kept.append(bytearray(b"x") * (8 * MIB))
        time.sleep(0.01)
    sleep()


# Time, memory and processes


@deed
def hangs() -> None:
    sleep()


@deed
def ignores_sigterm() -> None:
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sleep()


@deed
def stops_itself() -> None:
    os.kill(os.getpid(), signal.SIGSTOP)


@deed
def stops_its_keeper() -> None:
    os.kill(os.getppid(), signal.SIGSTOP)
    sleep()


@deed
def kills_its_keeper() -> None:
    os.kill(os.getppid(), signal.SIGKILL)
    sleep()


@deed
def kills_its_group() -> None:
    draw()
    os.killpg(0, signal.SIGKILL)


@deed
def spins() -> None:
    spin()


@deed
def spins_in_children() -> None:
    for _ in range(4):
        child(spin)
    sleep()


@deed
def detaches() -> None:
    detach(sleep)


@deed
def detaches_and_draws() -> None:
    detach(sleep)
    draw()


@deed
def detaches_and_hangs() -> None:
    """As above, with an empty environment."""
    daemon = [sys.executable, "-S", "-c", "import time; time.sleep(3600)"]
    leave("daemon", subprocess.Popen(daemon, env={}, start_new_session=True).pid)
    sleep()


@deed
def overwrites_late() -> None:
    """A daemon would write over the picture for as long as it lives."""

    def spoil() -> None:
        time.sleep(1.0)
        while True:
            write(grey)

    draw()
    detach(spoil)


@deed
def breeds() -> None:
    for _ in range(30):
        child(sleep)
    draw()


@deed
def leaves_zombies() -> None:
    for _ in range(60):
        if os.fork() == 0:
            os._exit(0)
    draw()


@deed
def eats_memory() -> None:
    hoard()


@deed
def eats_memory_in_children() -> None:
    for _ in range(6):
        child(lambda: hoard(80 * MIB))
    sleep()


@deed
def crashes() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


@deed
def killed_half_way() -> None:
    write(grey, cut=len(grey))
    os.kill(os.getpid(), signal.SIGKILL)


@deed
def exits_with_3() -> None:
    draw()
    sys.exit(3)


@deed
def fails_once() -> None:
    mark = f"{pictures}/failed-once"
    if not os.access(mark, os.F_OK):
        os.mkdir(mark)
        sys.exit(1)
    draw()


@deed
def asks_for_an_answer() -> None:
    sys.stdin.read()
    draw()


@deed
def closes_its_descriptors() -> None:
    os.closerange(0, 256)
    draw()


@deed
def floods_the_log() -> None:
    for _ in range(64):
        sys.stdout.write("x" * MIB)
    sys.exit(1)


@deed
def prints_escapes() -> None:
    """A terminal's clipboard and title, a build server's command, and what is no text."""
    os.write(
        1, b"\x1b]52;c;c2VjcmV0\x07\x1b]0;title\x07\x1b[8m\0\xff\xfe\r\n::error file=a.c::injected\n##[error]injected\n"
    )
    sys.exit(1)


# Pictures


@deed
def no_image() -> None:
    pass


@deed
def empty_image() -> None:
    put(b"")


@deed
def folder_image() -> None:
    os.mkdir(image)


@deed
def fifo_image() -> None:
    os.mkfifo(image)


@deed
def linked_image() -> None:
    os.symlink(f"{pictures}/good.pfm", image)


@deed
def hard_linked_image() -> None:
    """Of a picture that was there before the job."""
    os.utime(f"{pictures}/{name}.pfm", (1e9, 1e9))
    os.link(f"{pictures}/{name}.pfm", image)


@deed
def stale_image() -> None:
    write(grey)
    os.utime(image, (1e9, 1e9))


@deed
def image_of_the_future() -> None:
    draw()
    os.utime(image, (4e9, 4e9))


@deed
def wrong_size() -> None:
    write([0.25] * 48, (4, 4))


@deed
def negative_size() -> None:
    write(grey, (-width, -height))


@deed
def truncated() -> None:
    write(grey, cut=len(grey))


@deed
def runs_on() -> None:
    """The picture, and then eight megabytes that are none of it."""
    draw()
    with open(image, "ab") as out:
        out.write(bytes(8 * MIB))


@deed
def non_finite() -> None:
    write([*grey[:-1], float("nan")])


@deed
def enormous_values() -> None:
    write([3.4e38] * len(grey))


@deed
def negative() -> None:
    write([*grey[:-1], -1.0])


@deed
def swapped_bytes() -> None:
    """Its header says that the highest byte comes first."""
    put(f"PF\n{width} {height}\n1.0\n".encode() + array.array("f", grey).tobytes())


@deed
def one_channel() -> None:
    write(grey[::3], channels=1)


@deed
def not_a_picture() -> None:
    put(b"<script>alert('no')</script>\n" * 50)


@deed
def huge_header() -> None:
    write(grey, (100_000, 100_000))


@deed
def endless_header() -> None:
    put(b"PF\n" + b"9" * (8 * MIB))


@deed
def thousands_of_channels() -> None:
    """An EXR's header, whose channels a library would compare each with each."""
    listed = b"".join(f"c{number}\0".encode() + struct.pack("<iIii", 2, 0, 1, 1) for number in range(20_000)) + b"\0"
    put(b"v/1\x01" + struct.pack("<I", 2) + b"channels\0chlist\0" + struct.pack("<I", len(listed)) + listed + b"\0")


def chunk(kind: bytes, data: bytes) -> bytes:
    """A chunk of a PNG."""
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(wide: int, high: int, *chunks: bytes) -> bytes:
    head = chunk(b"IHDR", struct.pack(">IIBBBBB", wide, high, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + head + b"".join(chunks) + chunk(b"IEND", b"")


@deed
def hundreds_of_texts() -> None:
    """A PNG whose texts unpack to eight megabytes each."""
    text = chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(8 * MIB)))
    put(png(width, height, *[text] * 500, chunk(b"IDAT", zlib.compress(bytes((3 * width + 1) * height)))))


@deed
def picture_bomb() -> None:
    """A PNG of 40,000 x 40,000 pixels in five megabytes: the same packed block of zeros again and again."""
    side = 40_000
    whole, rest = divmod((3 * side + 1) * side, MIB)
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    blocks = [packer.compress(bytes(MIB)) + packer.flush(zlib.Z_FULL_FLUSH) for _ in range(2)]
    last = packer.compress(bytes(rest)) + packer.flush()
    check = struct.pack(">HH", (whole * MIB + rest) % 65521, 1)  # Adler-32 of zeros
    put(png(side, side, chunk(b"IDAT", b"\x78\x9c" + blocks[0] + blocks[1] * (whole - 1) + last + check)))


# Files and folders


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


with open(f"{pictures}/calls.txt", "a", encoding="utf-8") as calls:
    calls.write(name + "\n")
time.sleep(float(os.environ.get("PAUSE", "0")))
DEEDS.get(name, draw)()
