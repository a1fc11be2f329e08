"""Scenes of unknown making: what they refer to, what reading them costs, and that a good one is read as ever."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import notabug.scenes_usd.fence as fence
import notabug.scenes_usd.untrusted as untrusted
from notabug.scenes_usd import picture
from notabug.scenes_usd.catalogue import expected
from notabug.scenes_usd.errors import NotabugError, SceneError
from notabug.scenes_usd.fence import OutsideError
from notabug.scenes_usd.look import Look
from notabug.scenes_usd.reader import find, look_through, read_scene, survey_scene
from notabug.scenes_usd.view import View

BASE = find("calibration/plain_card").read_text(encoding="utf-8")
CARD = find("calibration/card").read_text(encoding="utf-8")


@pytest.fixture(autouse=True)
def _distrust(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_TRUST", "")


@pytest.fixture
def unfenced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the child, for tests of what this process checks itself."""
    monkeypatch.setattr("notabug.scenes_usd.reader.check_looks", lambda looks: None)


@pytest.fixture
def write(tmp_path: Path) -> Callable[[str], Path]:
    folder = tmp_path / "scene"
    folder.mkdir()
    (tmp_path / "outside.usda").write_text('#usda 1.0\n(\n    defaultPrim = "X"\n)\ndef Xform "X"\n{\n}\n')
    (folder / "inside.usda").write_text((tmp_path / "outside.usda").read_text())

    def written(text: str) -> Path:
        path = folder / "scene.usda"
        path.write_text(text, encoding="utf-8")
        return path

    return written


def test_a_scene_of_ones_own_is_read_and_then_remembered(
    write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    path = write(BASE + 'def "More" (\n    references = @./inside.usda@\n)\n{\n}\n')
    assert read_scene(path).digest() == read_scene("calibration/plain_card").digest()

    def never(*_: object, **__: object) -> None:
        raise AssertionError("read again in a child")

    monkeypatch.setattr(subprocess, "Popen", never)
    untrusted._passed.clear()  # as in another process
    read_scene(path)
    untrusted._passed.clear()
    (path.parent / "another.usda").write_text("")  # not of the scene
    read_scene(path)
    (path.parent / "inside.usda").write_text((path.parent / "inside.usda").read_text() + "\n")
    with pytest.raises(AssertionError, match="read again"):
        read_scene(path)
    path.write_text(path.read_text() + "\n")
    with pytest.raises(AssertionError, match="read again"):
        read_scene(path)


@pytest.mark.parametrize(
    "arc",
    [
        "references = @../outside.usda@",
        "payload = @../outside.usda@",
        "references = @{outside}@",
        "payload = @http://example.org/a.usda@",
        "prepend references = [@./inside.usda@, @../outside.usda@]",
        "references = @./link.usda@",
        "references = @./nested.usda@",
        "references = @./link.usda:SDF_FORMAT_ARGS:a=b@",
        "payload = @./linked/outside.usda@",
        "references = @./inner.usda@",
    ],
)
@pytest.mark.usefixtures("unfenced")
def test_what_lies_outside_is_refused(arc: str, write: Callable[[str], Path], tmp_path: Path) -> None:
    (tmp_path / "scene" / "link.usda").symlink_to(tmp_path / "outside.usda")
    (tmp_path / "scene" / "linked").symlink_to(tmp_path)
    (tmp_path / "scene" / "inner.usda").write_text("#usda 1.0\n(\n    subLayers = [@./link.usda@]\n)\n")
    nested = '#usda 1.0\n(\n    defaultPrim = "X"\n)\ndef "X" (\n    payload = @../outside.usda@\n)\n{\n}\n'
    (tmp_path / "scene" / "nested.usda").write_text(nested)
    text = arc.format(outside=tmp_path / "outside.usda")
    with pytest.raises(SceneError, match=r"outside of the scene's folder|may name only files"):
        read_scene(write(f'{BASE}\ndef "More" (\n    {text}\n)\n{{\n}}\n'))


@pytest.mark.usefixtures("unfenced")
def test_also_in_a_variant_that_is_not_chosen_and_in_sublayers(write: Callable[[str], Path]) -> None:
    hidden = '"point" (\n            payload = @../outside.usda@\n        ) {\n'
    assert '"point" {\n' in BASE
    with pytest.raises(SceneError, match="outside of the scene's folder"):
        read_scene(write(BASE.replace('"point" {\n', hidden)))
    with pytest.raises(SceneError, match="outside of the scene's folder"):
        read_scene(write(BASE.replace("(\n", "(\n    subLayers = [@../outside.usda@]\n", 1)))


SECRET = "root:x:0:0:no-USD-at-all:/root"
CLIPS = """clips = {{
        dictionary default = {{
            {what}
            string primPath = "/X"
            double2[] active = [(0, 0)]
            double2[] times = [(0, 0)]
        }}
    }}"""
HIDDEN = {
    "clips": CLIPS.format(what="asset[] assetPaths = [@../secret.usda@]"),
    "clips by a template": CLIPS.format(what='string templateAssetPath = "../secret.#.usda"'),
    "a manifest": CLIPS.format(what="asset manifestAssetPath = @../secret.usda@"),
    "an expression": 'references = @`"${P}"`@',
    "a folder of that name": 'payload = @`"../${Q}"`@',
    "a link with arguments": "references = @./link.usda:SDF_FORMAT_ARGS:a=b@",
    "a link": "references = @./link.usda@",
    "another format": "references = @./materials.mtlx@",
}


@pytest.mark.parametrize("fenced", [True, False])
@pytest.mark.parametrize("how", HIDDEN)
def test_no_way_leads_to_a_foreign_file_and_none_quotes_it(
    how: str, fenced: bool, write: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    if not fenced:
        monkeypatch.setattr("notabug.scenes_usd.reader.check_looks", lambda looks: None)
    (tmp_path / "secret.usda").write_text(SECRET)
    (tmp_path / "scene" / "link.usda").symlink_to(tmp_path / "secret.usda")
    (tmp_path / "scene" / '`"${P}"`').write_text("#usda 1.0\n")  # a decoy
    (tmp_path / "scene" / "materials.mtlx").write_text('<xi:include href="../secret.usda"/>')
    said = 'expressionVariables = {\n        string P = "../secret.usda"\n        string Q = "secret.usda"\n    }\n'
    text = BASE.replace("(\n", f"(\n    {said}", 1)
    path = write(f'{text}\ndef "More" (\n    {HIDDEN[how]}\n)\n{{\n}}\n')
    with pytest.raises(OutsideError) as caught:
        read_scene(path)
    assert "no-USD-at-all" not in str(caught.value)
    path = write(BASE.replace('"point" {\n', f'"point" (\n            {HIDDEN[how]}\n        ) {{\n'))  # not chosen
    with pytest.raises(OutsideError):
        read_scene(path)


@pytest.mark.parametrize(
    "texture",
    [
        "./link.png",
        "./linked/secret.png",
        "../secret.png",
        "./tile.<UDIM>.png",
        '`"${P}"`',
        "{folder}/secret.png",
        "./package.usdz[../secret.png]",
        "file:///{folder}/secret.png",
    ],
)
@pytest.mark.usefixtures("unfenced")
def test_no_texture_outside_is_opened(
    texture: str, write: Callable[[str], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    corpus = find("calibration/card").parent / "textures" / "card.png"
    for name in ("secret.png", "scene/package.usdz"):
        (tmp_path / name).write_bytes(corpus.read_bytes())
    for name in ("link.png", "tile.1001.png"):
        (tmp_path / "scene" / name).symlink_to(tmp_path / "secret.png")
    (tmp_path / "scene" / "linked").symlink_to(tmp_path)
    opened: list[Path] = []
    monkeypatch.setattr(picture, "_open", lambda path: opened.append(path) or 1 / 0)
    named = texture.format(folder=tmp_path) if "{folder}" in texture else texture
    text = CARD.replace("./textures/card.png", named)
    text = text.replace("(\n", '(\n    expressionVariables = {\n        string P = "../secret.png"\n    }\n', 1)
    with pytest.raises(SceneError):
        read_scene(write(text))
    assert not opened


@pytest.mark.usefixtures("unfenced")
def test_what_opens_all_the_same_is_found_after_composing(
    write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("notabug.scenes_usd.reader_stage.layers_of", lambda path: ())  # as if it knew nothing
    for arc in ("subLayers = [@../outside.usda@]", 'expressionVariables = {\n    string P = "../outside.usda"\n    }'):
        text = BASE.replace("(\n", f"(\n    {arc}\n", 1)
        if "P = " in arc:
            text += 'def "More" (\n    references = @`"${P}"`@\n)\n{\n}\n'
        with pytest.raises(OutsideError, match="outside of the scene's folder"):
            read_scene(write(text))


@pytest.mark.usefixtures("unfenced")
def test_a_table_of_expectations_outside_is_refused(write: Callable[[str], Path], tmp_path: Path) -> None:
    scene = read_scene(write(BASE))
    (tmp_path / "secret.toml").write_text('password = "no-USD-at-all"\n')
    (tmp_path / "scene" / "scene.expected.toml").symlink_to(tmp_path / "secret.toml")
    with pytest.raises(OutsideError) as caught:
        expected(scene)
    assert "password" not in str(caught.value)


def test_a_confined_process_reads_and_writes_nothing_else(tmp_path: Path) -> None:
    for name in ("inside", "outside", "own"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "file").write_text(name)
    code = f"""
import sys
from pathlib import Path
from notabug.scenes_usd.landlock import confine
at = Path({str(tmp_path)!r})
if not confine([at / "inside", Path(sys.prefix), Path(sys.base_prefix), at / "gone"], [at / "own"]):
    print("none here")
    sys.exit()
print((at / "inside" / "file").read_text())
(at / "own" / "new").write_text("x")
for deed in (lambda: (at / "outside" / "file").read_text(), lambda: (at / "inside" / "new").write_text("x"),
             lambda: (at / "inside" / "file").unlink(), lambda: list((at / "outside").iterdir())):
    try:
        deed()
    except PermissionError:
        print("refused")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    if done.stdout.strip() == "none here":
        pytest.skip("the system has no Landlock")
    assert done.stdout.split() == ["inside", "refused", "refused", "refused", "refused"]


@pytest.mark.usefixtures("unfenced")
def test_a_texture_outside_is_refused(write: Callable[[str], Path]) -> None:
    corpus = find("calibration/card").parent / "textures" / "card.png"
    with pytest.raises(SceneError, match="outside of the scene's folder"):
        read_scene(write(CARD.replace("./textures/card.png", str(corpus))))


def test_a_trusted_folder_passes(write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("NOTABUG_TRUST", str(tmp_path))
    assert read_scene(write(BASE + 'def "More" (\n    references = @../outside.usda@\n)\n{\n}\n')).objects


@pytest.mark.parametrize(
    "text",
    [
        BASE + 'def Xform "a"\n{\n' * 20_000 + "}\n" * 20_000,
        BASE + 'def "x" (\n customData = {\n' + "dictionary a = {\n" * 50_000 + "}\n" * 50_000 + "}\n)\n{\n}\n",
    ],
    ids=["prims", "dictionaries"],
)
def test_nesting_without_end_ends_only_the_child(text: str, write: Callable[[str], Path]) -> None:
    with pytest.raises(SceneError, match="nested too deep"):
        read_scene(write(text))


def test_a_scene_that_is_refused_for_a_layer_is_not_remembered(
    write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Its other layers were not looked at, and may be what harms when that one is mended."""
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    with pytest.raises(SceneError, match="outside of the scene's folder"):
        read_scene(write(BASE + 'def "More" (\n    references = @../outside.usda@\n)\n{\n}\n'))
    assert not (tmp_path / "cache" / "scenes").exists()


def test_one_child_reads_many_scenes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    files = [tmp_path / f"{index}.usda" for index in range(3)]
    for each in files:
        each.write_text(BASE)
    started, start = [], subprocess.Popen
    monkeypatch.setattr(subprocess, "Popen", lambda *words, **how: started.append(words) or start(*words, **how))
    look_through([(str(each), ()) for each in files])
    assert len(started) == 1
    for each in files:
        assert read_scene(each).objects
    assert len(started) == 1


def test_of_many_scenes_the_one_that_ends_its_reader_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    files = [tmp_path / f"{index}.usda" for index in range(3)]
    for each in files:
        each.write_text(BASE)
    files[1].write_text(BASE + 'def Xform "a"\n{\n' * 20_000 + "}\n" * 20_000)
    wrong = look_through([(str(each), ()) for each in files])
    assert list(wrong) == [(str(files[1]), ())]
    assert "nested too deep" in str(wrong[str(files[1]), ()])
    assert str(files[1]) in str(wrong[str(files[1]), ()])
    assert read_scene(files[2]).objects


@pytest.fixture
def ends_at_bomb(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> list[Look]:
    """Readers that end by a signal where the variant ``bomb=yes``, frame 7 or the camera /C is read; what they read."""
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    seen: list[Look] = []
    start = subprocess.Popen

    def started(command: list[str], **how: Any) -> Any:
        looks = [Look.from_text(text) for text in command[5:]]
        seen.extend(looks)
        harms = any(look.variants == (("bomb", "yes"),) or look.view.time == 7 for look in looks)
        harms = harms or any(look.view.camera == "/C" for look in looks)
        return start([sys.executable, "-S", "-c", "import os; os.abort()"] if harms else command, **how)

    monkeypatch.setattr(subprocess, "Popen", started)
    return seen


WITH_BOMB = BASE.replace('variantSets = "light"', 'variantSets = ["light", "bomb"]').replace(
    'string light = "distant"', 'string light = "distant"\n        string bomb = "no"'
)
WITH_BOMB = WITH_BOMB.replace(
    ")\n{\n", ')\n{\n    variantSet "bomb" = {\n        "no" {\n}\n        "yes" {\n}\n    }\n', 1
)


def test_a_variant_that_ends_its_reader_ends_only_the_child(
    write: Callable[[str], Path], ends_at_bomb: list[Look]
) -> None:
    """The default passes, and says nothing of what another variant, frame or camera costs."""
    path = write(WITH_BOMB)
    assert read_scene(path).variants["bomb"] == "no"
    with pytest.raises(SceneError, match=r"\[bomb=yes\]: reading this file ends its reader"):
        read_scene(path, {"bomb": "yes"})
    for view in (View(time=7.0), View(camera="/C")):
        with pytest.raises(SceneError, match="reading this file ends its reader"):
            survey_scene(path, {}, view)
    assert survey_scene(path, {}, View(time=1.0)).scene is not None
    count = len(ends_at_bomb)
    untrusted._passed.clear()  # as in another process
    assert read_scene(path, {"bomb": "no"}).variants["bomb"] == "no"
    assert read_scene(path).objects
    assert len(ends_at_bomb) == count + 1  # what was named is another look than the default


def test_a_look_says_all_that_is_read(tmp_path: Path) -> None:
    path = tmp_path / "a\udcff \u00e9.usda"
    for view in (View(), View(camera="/C", time=2.5, purposes=frozenset({"default", "guide"}))):
        look = Look.at(path, {"b": "2", "a": "1"}, view)
        assert look.as_text().isascii()
        again = Look.from_text(look.as_text())
        assert (again.path, again.variants, replace(again.view, quick=False)) == (path, (("a", "1"), ("b", "2")), view)


def test_what_harms_is_remembered_until_it_changes(
    write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("NOTABUG_CACHE", str(tmp_path / "cache"))
    path = write(BASE + 'def "More" (\n    references = @../outside.usda@\n)\n{\n}\n')
    with pytest.raises(OutsideError):
        read_scene(path)
    with monkeypatch.context() as patch:
        patch.setattr(subprocess, "Popen", lambda *_, **__: 1 / 0)
        with pytest.raises(OutsideError):
            read_scene(path)
    path.write_text(BASE)
    assert read_scene(path).objects


@pytest.mark.parametrize(
    ("code", "ends"),
    [
        ("import time; time.sleep(3600)", False),
        ("import time\nwhile time.process_time() < 0.6: pass", True),  # at work, for longer than STILL
        ("import os, signal; os.kill(os.getpid(), signal.SIGSTOP)", False),
    ],
)
def test_a_reader_that_waits_is_given_up_and_one_at_work_is_not(
    code: str, ends: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(untrusted, "LOOK", 0.1)
    monkeypatch.setattr(untrusted, "STILL", 0.3)
    child = subprocess.Popen([sys.executable, "-S", "-c", code])
    try:
        assert untrusted._wait(child) is ends
    finally:
        child.kill()
        child.wait()


def test_the_reason_that_is_given_is_the_one_that_was_seen() -> None:
    assert "too long" in untrusted._ending(-24, b"").reason
    assert "too large" in untrusted._ending(1, b"Traceback\nMemoryError\n").reason
    assert "nested too deep" in untrusted._ending(-11, b"").reason


def test_a_file_without_end_is_not_opened(write: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fence, "FILE", 1000)
    with pytest.raises(SceneError, match="too large"):
        read_scene(write(BASE))


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e39"])
@pytest.mark.usefixtures("unfenced")
def test_a_transform_that_is_not_finite_is_refused(number: str, write: Callable[[str], Path]) -> None:
    turned = (
        f'double3 xformOp:translate = ({number}, 0, 0)\n        uniform token[] xformOpOrder = ["xformOp:translate"]'
    )
    text = BASE.replace(
        'uniform token subdivisionScheme = "none"', f'uniform token subdivisionScheme = "none"\n        {turned}', 1
    )
    if number == "1e39":
        text = text.replace("1e39", "1e309")
    with pytest.raises(NotabugError):
        read_scene(write(text))


WORDS = st.sampled_from(
    [
        "nan",
        "inf",
        "-1",
        "1e308",
        "0",
        "[]",
        "()",
        '"',
        "@",
        "{",
        "}",
        "\n",
        "../",
        "None",
        "point",
        "Sphere",
        "\0",
        "é",
    ]
)


@pytest.mark.usefixtures("unfenced")
@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_damaged_scene_is_read_or_refused_by_name(data: st.DataObject, write: Callable[[str], Path]) -> None:
    source = data.draw(st.sampled_from([BASE, CARD]))
    for _ in range(data.draw(st.integers(1, 3))):
        start = data.draw(st.integers(0, len(source) - 1))
        length = data.draw(st.integers(0, 12))
        source = source[:start] + data.draw(WORDS | st.text(max_size=4)) + source[start + length :]
    path = write("")
    path.write_text(source, encoding="utf-8", errors="replace")
    try:
        scene = read_scene(path)
    except NotabugError:
        return
    assert scene.objects
