"""A configured renderer that is started once: its pictures, and what each way of breaking the protocol costs."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest
from hypothesis import given
from hypothesis import strategies as st

from notabug.adapters.answers import LONGEST
from notabug.adapters.base import Quality, Render, RendererError
from notabug.adapters.config import ConfigError, Table
from notabug.adapters.configured import configured
from notabug.adapters.kept import end_kept
from notabug.adapters.server import AnswerError, read_answer, read_greeting
from notabug.scenes_usd.picture import read_picture

SERVER = """
import json, os, sys, time
def say(*words): print(*words, flush=True)
how = sys.argv[1]
with open(os.environ["STARTED"], "a") as file: print(os.getpid(), file=file)
print("starts", file=sys.stderr, flush=True)
if how == "dead": sys.exit(3)
if how == "deaf": time.sleep(60)
if how == "rude": say("Hello!")
if how == "newer": say('{"notabug_server": 2}')
if how == "doubled": say('{"notabug_server": 1}'); say("ready"); time.sleep(.2)
if how not in ("rude", "newer", "doubled"): say('{"notabug_server": 1}')
for place, line in enumerate(sys.stdin, 1):
    job = json.loads(line)
    print("draws", job["seed"], file=sys.stderr, flush=True)
    turn = job["seed"] == 1  # the second picture of each test
    size = job["width"] * job["height"]
    with open(job["image"], "wb") as file:
        file.write(b"PF\\n%d %d\\n-1.0\\n" % (job["width"], job["height"]) + b"\\0\\0\\0\\x3f" * (3 * size))
    ok = json.dumps({"job": job["job"], "ok": True})
    if turn and how == "crash": os.abort()
    if turn and how == "leave": sys.exit(0)
    if turn and how == "hang": time.sleep(60)
    if turn and how == "garbage": say("Fra:1 Mem:12M")
    if turn and how == "empty": say("")
    if turn and how == "list": say("[1]")
    if turn and how == "long": print("x" * 200000, end="", flush=True); time.sleep(60)
    if turn and how == "other": say(json.dumps({"job": job["job"] - 1, "ok": True}))
    if turn and how == "twice": print(ok + "\\n" + ok, flush=True); continue
    if turn and how == "shut": os.close(1); time.sleep(60)
    if turn and how == "half": print(ok[:9], end="", flush=True); os.close(1); time.sleep(60)
    if turn and how == "refuse": say(json.dumps({"job": job["job"], "error": "no such texture: wood.png"})); continue
    if turn and how == "none": os.remove(job["image"])
    if turn and how == "spill": open(os.path.dirname(job["image"]) + "/more", "wb").write(b"x" * 3000000)
    if turn and how == "burn":
        while True: pass
    say(ok)
    if turn and how == "last": sys.exit(0)
    if turn and how == "chat": say("picture saved")
"""


@pytest.fixture(autouse=True)
def _ended() -> Iterator[None]:
    yield
    end_kept()


class Desk:
    """A renderer whose server misbehaves in one way with the picture of seed 1, and what was started for it."""

    def __init__(self, folder: Path, how: str, **values: Any) -> None:
        self.folder, self.started = folder, folder / "started"
        (folder / "server.py").write_text(SERVER)
        told = {"command": [sys.executable, "server.py", how], "environment": {"STARTED": str(self.started)}}
        table = {**told, "server": True, "image": "pfm", "version": "1", "noisy": True} | values
        self.adapter = configured("mine", Table(table, "notabug.toml.renderers.mine", folder), {})

    def draw(self, scene: Any, seed: int) -> Render:
        out = self.folder / f"out{seed}"
        out.mkdir(exist_ok=True)
        (render,) = self.adapter.render(scene, out, Quality(seeds=(seed,)))
        return render

    def starts(self) -> list[int]:
        return [int(line) for line in self.started.read_text().split()]


@pytest.fixture
def scene(stage: Any) -> Any:
    return stage.scene((stage.quad(),), (stage.distant((0, -1, 0)),), stage.camera((0, 3, 3)), size=(6, 4))


def test_it_is_started_once_and_draws_picture_after_picture(scene: Any, tmp_path: Path) -> None:
    desk = Desk(tmp_path, "well")
    out = tmp_path / "out"
    out.mkdir()
    renders = desk.adapter.render(scene, out, Quality(seeds=(0, 1, 2, 3)))
    assert [read_picture(render.image).pixels.mean() for render in renders] == [0.5] * 4
    assert len(desk.starts()) == 1
    assert "draws 3" in renders[3].log
    assert "draws 2" not in renders[3].log
    told = json.loads(renders[3].log.splitlines()[0].removeprefix("notabug: "))
    assert told.keys() == {"job", "scene", "image", "width", "height", "samples", "seed", "threads"}
    assert (told["width"], told["height"], told["seed"]) == (6, 4, 3)


BROKEN = {
    "crash": r"the server ended; expected an answer to job \d+, got SIGABRT",
    "leave": r"the server ended; expected an answer to job \d+, got exit code 0",
    "hang": r"stopped after \d.\d s, its time limit",
    "garbage": r"a line on standard output is no answer; expected .*got 'Fra:1 Mem:12M'",
    "empty": r"a line on standard output is no answer; expected .*got ''",
    "list": r"a line on standard output is no answer; expected .*got '\[1\]'",
    "long": rf"a line of more than {LONGEST} bytes on standard output",
    "other": r"an answer to another job",
    "shut": r"the server closed its standard output; expected an answer",
    "half": r"a line on standard output is no answer",
    "spill": r"stopped after .*its output limit",
    "burn": r"stopped after .*its limit of processor time",
}


@pytest.mark.parametrize("how", BROKEN)
def test_what_breaks_the_protocol_or_a_limit_costs_its_own_picture(scene: Any, tmp_path: Path, how: str) -> None:
    limits = {"hang": {"timeout": 3.0}, "spill": {"output": 2_000_000}, "burn": {"cpu": 0.5}}
    desk = Desk(tmp_path, how, **limits.get(how, {}))
    desk.draw(scene, 0)
    with pytest.raises(RendererError, match=BROKEN[how]) as caught:
        desk.draw(scene, 1)
    assert "draws 1" in caught.value.log
    assert '"seed": 1' in caught.value.log
    desk.draw(scene, 2)
    first, second = desk.starts()
    assert not psutil.pid_exists(first)
    assert psutil.pid_exists(second)


@pytest.mark.parametrize(
    ("how", "says"),
    [("refuse", "the server could not draw it: no such texture: wood.png"), ("none", "left no picture")],
)
def test_a_picture_that_could_not_be_drawn_costs_no_new_server(scene: Any, tmp_path: Path, how: str, says: str) -> None:
    desk = Desk(tmp_path, how)
    desk.draw(scene, 0)
    with pytest.raises(RendererError, match=says):
        desk.draw(scene, 1)
    desk.draw(scene, 2)
    assert len(desk.starts()) == 1


@pytest.mark.parametrize("how", ["chat", "twice"])
def test_a_line_that_nobody_asked_for_is_told_and_not_taken_for_an_answer(scene: Any, tmp_path: Path, how: str) -> None:
    desk = Desk(tmp_path, how)
    for seed in (0, 1):
        desk.draw(scene, seed)
    with pytest.raises(RendererError, match=r"a line that nobody had asked for|is no answer|an answer to another job"):
        desk.draw(scene, 2)
    desk.draw(scene, 3)
    assert len(desk.starts()) == 2


def test_a_server_that_leaves_between_two_pictures_is_started_again(scene: Any, tmp_path: Path) -> None:
    desk = Desk(tmp_path, "last")
    for seed in (0, 1):
        desk.draw(scene, seed)
    with contextlib.suppress(psutil.NoSuchProcess):
        psutil.Process(desk.starts()[0]).wait(30)
    desk.draw(scene, 2)
    assert len(desk.starts()) == 2


START = {
    "dead": r'the server ended; expected the line {"notabug_server": 1}, got exit code 3(.|\n)*\| starts',
    "deaf": r"the server did not say within 0.5 s that it is ready(.|\n)*raise start_timeout",
    "rude": r"the server's first line is not its greeting; expected .*, got 'Hello!'",
    "newer": r"the server speaks another version of the protocol; expected {\"notabug_server\": 1}",
}


@pytest.mark.parametrize("how", START)
def test_a_server_that_does_not_get_ready_says_why(scene: Any, tmp_path: Path, how: str) -> None:
    desk = Desk(tmp_path, how, start_timeout=0.5 if how == "deaf" else 60)
    for _ in range(2):
        with pytest.raises(RendererError, match=START[how]):
            desk.draw(scene, 0)
    assert not any(psutil.pid_exists(pid) for pid in desk.starts())


def test_what_is_said_before_the_first_job_is_no_answer(scene: Any, tmp_path: Path) -> None:
    desk = Desk(tmp_path, "doubled")
    with pytest.raises(RendererError, match=r"no answer.*got 'ready'|nobody had asked for.*got 'ready'"):
        desk.draw(scene, 0)


def test_a_program_that_is_no_program_says_so(scene: Any, tmp_path: Path) -> None:
    desk = Desk(tmp_path, "well")
    (tmp_path / "broken").write_text("no program")
    (tmp_path / "broken").chmod(0o755)
    table = {"command": ["./broken"], "server": True, "image": "pfm", "version": "1"}
    desk.adapter = configured("mine", Table(table, "notabug.toml.renderers.mine", tmp_path), {})
    with pytest.raises(RendererError, match=r"cannot start .*broken"):
        desk.draw(scene, 0)


def test_a_changed_program_is_started_anew(scene: Any, tmp_path: Path) -> None:
    desk = Desk(tmp_path, "well")
    desk.draw(scene, 0)
    (tmp_path / "server.py").write_text(SERVER.replace("\\x3f", "\\x40"))
    assert read_picture(desk.draw(scene, 1).image).pixels.mean() == 2.0
    first, _ = desk.starts()
    assert not psutil.pid_exists(first)


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("", "no answer"),
        ("nonsense", "no answer"),
        ("[" * 5000, "no answer"),
        ('{"job": 7}', "other keys"),
        ('{"job": 7, "ok": true, "error": "x"}', "other keys"),
        ('{"job": 7, "ok": true, "seconds": 3}', "other keys"),
        ('{"job": "7", "ok": true}', "no whole number"),
        ('{"job": true, "ok": true}', "no whole number"),
        ('{"job": 7.0, "ok": true}', "no whole number"),
        ('{"job": 8, "ok": true}', "another job"),
        ('{"job": 7, "ok": 1}', "neither ok nor an error"),
        ('{"job": 7, "ok": false}', "neither ok nor an error"),
        ('{"job": 7, "error": ""}', "without a text"),
        ('{"job": 7, "error": null}', "without a text"),
        ("x" * (LONGEST + 1), "more than"),
    ],
)
def test_an_answer_is_taken_strictly(line: str, says: str) -> None:
    with pytest.raises(AnswerError, match=says):
        read_answer(line, 7)


@given(line=st.text() | st.recursive(st.none() | st.booleans() | st.integers() | st.text(), st.lists).map(json.dumps))
def test_no_line_at_all_is_taken_for_an_answer_by_accident(line: str) -> None:
    with pytest.raises(AnswerError):
        read_answer(line, 7)
    with pytest.raises(AnswerError):
        read_greeting(line)


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({"command": ["x", "{scene}"]}, "changes from picture to picture"),
        ({"environment": {"SEED": "{seed}"}}, "a server reads it from the line of each job"),
        ({"command": ["x", "{nonsense}"]}, "unknown placeholder"),
        ({"server": "yes"}, "not a truth value"),
        ({"start_timeout": 0}, "not a number in its range"),
        ({"server": False, "command": ["x", "{scene}", "{image}"], "start_timeout": 5}, "is for servers"),
    ],
)
def test_a_wrong_table_is_told(values: dict[str, Any], says: str) -> None:
    table = {"command": ["x", "{folder}", "{threads}"], "server": True} | values
    with pytest.raises(ConfigError, match=says):
        configured("mine", Table(table, "notabug.toml.renderers.mine", Path()), {})
