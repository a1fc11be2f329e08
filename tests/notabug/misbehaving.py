"""A renderer that misbehaves as the scene is called: ``misbehaving.py scene.json image.pfm pictures``.

Scenes without a misdeed of their name, the card among them, are copied from ``pictures``. Nothing but the standard
library is imported.
"""

import array
import json
import os
import shutil
import signal
import subprocess
import sys
import time

scene, image, pictures = sys.argv[1:4]
with open(scene, encoding="utf-8") as file:
    said = json.load(file)
name, width, height = said["scene"].replace("/", "-"), said["width"], said["height"]


def leave(kind, pid):
    with open(f"{pictures}/{kind}-{pid}.pid", "w", encoding="utf-8") as note:
        note.write(name)


def write(values, size=None, channels=3, cut=0):
    wide, high = size or (width, height)
    head = f"{'PF' if channels == 3 else 'Pf'}\n{wide} {high}\n-1.0\n".encode()
    with open(image, "wb") as out:
        data = head + array.array("f", values).tobytes()
        out.write(data[: len(data) - cut])


def draw():
    shutil.copyfile(f"{pictures}/{name}.pfm", image)


def detach():
    """A daemon: two forks and a session of its own; it would sleep for an hour."""
    if os.fork() == 0:
        os.setsid()
        if os.fork() == 0:
            leave("daemon", os.getpid())
            time.sleep(3600)
        os._exit(0)
    os.wait()


def detach_without_traces():
    """As above, with an empty environment."""
    daemon = [sys.executable, "-S", "-c", "import time; time.sleep(3600)"]
    leave("daemon", subprocess.Popen(daemon, env={}, start_new_session=True).pid)


with open(f"{pictures}/calls.txt", "a", encoding="utf-8") as calls:
    calls.write(name + "\n")
time.sleep(float(os.environ.get("PAUSE", "0")))
grey = [0.25] * (3 * width * height)
if name == "hangs":
    time.sleep(3600)
elif name == "ignores_sigterm":
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    time.sleep(3600)
elif name == "spins":
    while True:
        pass
elif name == "detaches":
    detach()
elif name == "detaches_and_draws":
    detach()
    draw()
elif name == "detaches_and_hangs":
    detach_without_traces()
    time.sleep(3600)
elif name == "no_image":
    pass
elif name == "stale_image":
    write(grey)
    os.utime(image, (1e9, 1e9))
elif name == "linked_image":
    os.symlink(f"{pictures}/good.pfm", image)
elif name == "wrong_size":
    write([0.25] * 48, (4, 4))
elif name == "truncated":
    write(grey, cut=len(grey))
elif name == "non_finite":
    write([*grey[:-1], float("nan")])
elif name == "negative":
    write([*grey[:-1], -1.0])
elif name == "one_channel":
    write(grey[::3], channels=1)
elif name == "not_a_picture":
    with open(image, "w", encoding="utf-8") as out:
        out.write("<script>alert('no')</script>\n" * 50)
elif name == "huge_header":
    write(grey, (100_000, 100_000))
elif name == "gigabyte":
    with open(image, "wb") as out:
        for _ in range(1024):
            out.write(bytes(1 << 20))
elif name == "fills_the_disk":
    for number in range(1024):
        with open(f"file{number}", "wb") as out:
            out.write(bytes(1 << 20))
        time.sleep(0.01)
elif name == "floods_the_log":
    for _ in range(64):
        sys.stdout.write("x" * (1 << 20))
    sys.exit(1)
elif name == "eats_memory":
    hoard = []
    while True:
        hoard.append(bytearray(b"x") * (8 << 20))
        time.sleep(0.01)
elif name == "crashes":
    os.kill(os.getpid(), signal.SIGSEGV)
elif name == "killed_half_way":
    write(grey, cut=len(grey))
    os.kill(os.getpid(), signal.SIGKILL)
elif name == "exits_with_3":
    draw()
    sys.exit(3)
elif name == "fails_once":
    mark = f"{pictures}/failed-once"
    if not os.access(mark, os.F_OK):
        os.mkdir(mark)
        sys.exit(1)
    draw()
else:
    draw()
