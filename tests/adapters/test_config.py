"""The configuration file: which one counts, what a table becomes, and what is said of a wrong one."""

from __future__ import annotations

import contextlib
import json
import os
import subprocess
import sys
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import notabug.adapters.registry as registry
from notabug.adapters import settings as typed
from notabug.adapters.base import Adapter, Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.command import Command
from notabug.adapters.config import ConfigError, Table, find_config, renderer_tables
from notabug.adapters.configured import COMMAND_KEYS, LIMIT_KEYS, configured
from notabug.adapters.declared import KEYS
from notabug.adapters.files import Files
from notabug.adapters.zbuffer import ZBuffer
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import read_picture, write_exr, write_png
from notabug.scenes_usd.reader import read_scene

GOOD = {"command": ["./render", "{scene}", "{image}"]}


def table(folder: Path = Path(), **values: Any) -> Table:
    return Table(values, "notabug.toml.renderers.mine", folder)


@pytest.mark.parametrize(
    ("name", "got"),
    [("x" * 300, "300 of them, 'xxxxxxxxxxxxxxxxxxxx'..."), ("", "''"), ("a/../b", "'a/../b'"), ("a\tb", r"'a\tb'")],
)
def test_a_wrong_name_is_told_in_short_and_with_the_rule_that_it_breaks(name: str, got: str, tmp_path: Path) -> None:
    path = tmp_path / "notabug.toml"
    path.write_text(f"[renderers.{json.dumps(name)}]\ncommand = ['x', '{{scene}}', '{{image}}']\n")
    with pytest.raises(ConfigError) as caught:
        renderer_tables(path)
    assert caught.value.got == got
    assert "1 to 60 printable characters" in str(caught.value)


def test_the_nearest_file_counts_and_notabug_toml_comes_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("NOTABUG_CONFIG", raising=False)
    inner = tmp_path / "a" / "b"
    inner.mkdir(parents=True)
    above, shared, own = tmp_path / "notabug.toml", tmp_path / "a" / "pyproject.toml", tmp_path / "a" / "notabug.toml"
    above.write_text("")
    shared.write_text('[project]\nname = "notabug-user"\n')
    assert find_config(inner) == above, "a pyproject.toml of other things does not count"
    shared.write_text("[tool.notabug.renderers.mine]\ncommand = []\n")
    assert find_config(inner) == shared
    own.write_text("")
    assert find_config(inner) == own
    monkeypatch.setenv("NOTABUG_CONFIG", str(above))
    assert find_config(inner) == above


def test_both_files_say_the_same(tmp_path: Path) -> None:
    (tmp_path / "notabug.toml").write_text('[renderers.mine]\ncommand = ["x"]\n')
    (tmp_path / "pyproject.toml").write_text('[tool.notabug.renderers.mine]\ncommand = ["x"]\n')
    one, other = (renderer_tables(tmp_path / name)["mine"] for name in ("notabug.toml", "pyproject.toml"))
    assert one.values == other.values == {"command": ["x"]}
    assert one.folder == other.folder == tmp_path.resolve()


def test_a_full_table_becomes_a_command(tmp_path: Path) -> None:
    made = configured(
        "mine",
        table(
            tmp_path,
            **GOOD,
            scene="gltf",
            image="png",
            pixels="uint16",
            encoding="srgb",
            precision="float64",
            filter="gaussian",
            radius=1.5,
            noisy=True,
            capabilities=["mesh"],
            environment={"THREADS": "{threads}"},
            timeout=12,
            cpu=30,
            memory="1.5 GiB",
            output=1000,
            retries=2,
            samples=64,
            version="2.1",
            depth="fixed24",
        ),
        {},
    )
    assert isinstance(made, Command)
    declared = made.declaration(Quality())
    assert (declared.precision, declared.filter, declared.radius, declared.noisy) == ("float64", "gaussian", 1.5, True)
    assert (declared.ngon_split, declared.depth, declared.relative_quantum) == ("02", "fixed24", False)
    assert declared.quantum == pytest.approx(2.4 / 1.055 / 65535)
    assert declared.white == 1.0
    assert (made.limits.memory, made.limits.output, made.limits.cpu) == (3 << 29, 1000, 30)
    assert (made.timeout, made.retries, made.samples, made.capabilities) == (12, 2, 64, {"mesh"})
    assert [made.declaration(each).samples for each in (Quality(), Quality(samples=9))] == [64, 9]


def test_an_error_of_hits_that_is_not_declared_is_that_of_the_precision(tmp_path: Path) -> None:
    """Whatever the filter: the radius of a box is no error."""
    for words in ({}, {"filter": "point"}, {"filter": "box"}, {"filter": "tent", "radius": 2.0}):
        made = configured("mine", table(tmp_path, **GOOD, **words), {})
        assert made.declaration(Quality()).hit_error == 8 * 2.0**-24
    made = configured("mine", table(tmp_path, **GOOD, hit_error=1e-5), {})
    assert made.declaration(Quality()).hit_error == 1e-5


@pytest.mark.parametrize(
    ("values", "says"),
    [
        ({**GOOD, "comand": 1}, "unknown key 'comand'.*did you mean 'command'"),
        ({**GOOD, "presicion": "float32"}, "did you mean 'precision'"),
        ({"command": "render {scene}"}, "not a list"),
        ({"command": []}, "empty"),
        ({}, "command: missing"),
        ({"command": ["./render", "{scene}"]}, "does not name {image}"),
        ({"command": ["./render", "{scene}", "{image}", "{sample}"]}, "unknown placeholder '{sample}'"),
        ({"command": ["./render", "{scene.__class__}", "{image}"]}, "unknown placeholder"),
        ({"command": ["./render", "{scene}", "{image}", "a}b"]}, "unknown placeholder '}'"),
        ({"command": ["./render", "{scene}\0", "{image}"]}, "not a list of strings"),
        ({**GOOD, "scene": "fbx"}, "scene: .*expected one of json"),
        ({**GOOD, "precision": "float16"}, "precision: .*float32, float64"),
        ({**GOOD, "timeout": -1}, "timeout: not a number in its range"),
        ({**GOOD, "timeout": float("nan")}, "timeout: not a number in its range"),
        ({**GOOD, "noisy": "yes"}, "noisy: not a truth value"),
        ({**GOOD, "memory": "2 bananas"}, "memory: not a size"),
        ({**GOOD, "capabilities": ["meshes"]}, "unknown capability 'meshes'"),
        ({**GOOD, "environment": {"A=B": "1"}}, "not a name of a variable"),
        ({**GOOD, "environment": "A=1"}, "environment: not a table"),
        ({"adapter": "nothing"}, "adapter: .*got 'nothing'"),
        ({"adapter": "zbuffer", "dept": "fixed16"}, "did you mean 'depth'"),
        ({"adapter": "zbuffer", "depth": "fixed12"}, "depth: .*fixed16"),
    ],
)
def test_a_wrong_table_is_refused_by_key(values: dict[str, Any], says: str) -> None:
    with pytest.raises(ConfigError, match=says) as error:
        configured("mine", table(**values), {"zbuffer": ZBuffer()})
    assert "notabug.toml.renderers.mine" in str(error.value)


@pytest.mark.parametrize(
    "values", [GOOD, {"command": ["./render"]}, {"files": "renders"}, {"scene": "json", "image": "pfm"}]
)
def test_one_s_own_renderer_needs_a_name_of_its_own(values: dict[str, Any]) -> None:
    with pytest.raises(ConfigError, match=r"notabug itself has .* 'mine'.*call the table, say, \[renderers.my_mine\]"):
        configured("mine", table(**values), {"mine": ZBuffer()})


@pytest.mark.parametrize("values", [{"depth": "fixed16"}, {"adapter": "mine", "depth": "fixed16"}])
def test_a_table_of_a_known_name_sets_it(values: dict[str, Any]) -> None:
    made = configured("mine", table(**values), {"mine": ZBuffer()})
    assert (made.name, getattr(made, "depth", "")) == ("mine", "fixed16")


def test_a_known_adapter_can_be_set_under_another_name() -> None:
    made = configured("coarse", table(adapter="zbuffer", depth="fixed16"), {"zbuffer": ZBuffer()})
    assert isinstance(made, ZBuffer)
    assert (made.name, made.depth) == ("coarse", "fixed16")


@pytest.mark.parametrize("text", ["[renderers", "renderers = 3", "[renderers]\nmine = 3", '[renderers."a/b"]', "x = 1"])
def test_a_wrong_file_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "notabug.toml").write_text(text)
    with pytest.raises(ConfigError, match=r"notabug\.toml"):
        renderer_tables(tmp_path / "notabug.toml")


@given(st.text(max_size=40), st.text(max_size=40))
def test_what_a_value_holds_is_not_read_again(one: str, other: str) -> None:
    filled = typed.filled("{scene}|{image}", {"scene": one, "image": other})
    assert filled == f"{one}|{other}"


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=6,
)
NAMES = st.sampled_from(
    ["command", "files", "adapter", "scene", "memory", "environment", "radius", "filter", "version"]
)


@settings(max_examples=300)
@given(st.dictionaries(NAMES | st.text(max_size=10), VALUES, max_size=4))
def test_any_table_is_an_adapter_or_a_clear_error(values: dict[str, Any]) -> None:
    with contextlib.suppress(ConfigError):
        configured("mine", table(**values), {"zbuffer": ZBuffer()})


@settings(max_examples=200)
@given(st.binary(max_size=200) | st.text(max_size=200).map(lambda text: text.encode("utf-8", "surrogatepass")))
def test_any_bytes_are_a_configuration_or_a_clear_error(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "fuzz-notabug.toml"
    path.write_bytes(data)
    with contextlib.suppress(ConfigError):
        renderer_tables(path)


def echo(folder: Path, **values: Any) -> Adapter:
    """A renderer that prints its words and environment and draws nothing."""
    code = "import os, sys; print(sys.argv[1:], os.environ.get('GIVEN'))"
    return configured(
        "echo", table(folder, command=[sys.executable, "-c", code, "{scene}", "{image}", "$HOME; `x`"], **values), {}
    )


def test_no_shell_reads_the_command(tmp_path: Path) -> None:
    adapter = echo(tmp_path, environment={"GIVEN": "{width}x{height} $HOME"})
    with pytest.raises(RendererError) as error:
        adapter.render(read_scene("calibration/plain_card"), tmp_path, Quality())
    assert "'$HOME; `x`'" in error.value.log
    assert "256x256 $HOME" in error.value.log


def test_a_program_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(RendererMissingError, match=r"no executable '\./render'"):
        configured("mine", table(tmp_path, **GOOD), {}).find()


def test_a_changed_program_is_another_version(tmp_path: Path) -> None:
    program = tmp_path / "render"
    program.write_text("#!/bin/sh\n")
    program.chmod(0o755)
    adapter = configured("mine", table(tmp_path, **GOOD), {})
    first = adapter.find().version
    program.write_text("#!/bin/sh\n# changed\n")
    assert adapter.find().version != first


def test_files_are_matched_by_name(tmp_path: Path) -> None:
    card, ball = read_scene("calibration/card"), read_scene("terminator/sphere", {"tessellation": "8x4"})
    adapter = configured("mine", table(tmp_path, files="pictures", filter="box", noisy=True), {})
    with pytest.raises(RendererMissingError, match="no such folder"):
        adapter.find()
    out = tmp_path / "out"
    out.mkdir()
    for name, value in (
        ("calibration/card.exr", 1.0),
        ("terminator/sphere.exr", 2.0),
        ("terminator/sphere/tessellation=8x4/a.exr", 3.0),
        ("terminator/sphere/tessellation=8x4/b.exr", 4.0),
    ):
        path = tmp_path / "pictures" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_exr(path, np.full((4, 4, 3), value))

    def drawn(scene: Any) -> list[float]:
        return [float(read_picture(each.image).pixels[0, 0, 0]) for each in adapter.render(scene, out, Quality())]

    assert drawn(card) == [1.0]
    assert drawn(ball) == [3.0, 4.0]
    assert drawn(read_scene("terminator/sphere")) == [2.0]
    with pytest.raises(RendererError, match="no picture of this scene"):
        drawn(read_scene("terminator/sphere", {"tessellation": "96x48"}))
    with pytest.raises(UnsupportedError, match="no picture of this scene"):
        drawn(read_scene("calibration/plain_card"))
    assert isinstance(adapter, Files)
    assert adapter.declaration(Quality(samples=4)).samples == 0  # how they were rendered only their table can say


def test_a_coarser_file_than_declared_is_refused(tmp_path: Path) -> None:
    (tmp_path / "pictures" / "calibration").mkdir(parents=True)
    (tmp_path / "out").mkdir()
    write_png(tmp_path / "pictures" / "calibration" / "card.png", np.zeros((4, 4, 3)))
    scene = read_scene("calibration/card")
    with pytest.raises(RendererError, match="coarser than the declared float"):
        configured("mine", table(tmp_path, files="pictures"), {}).render(scene, tmp_path / "out", Quality())
    fine = configured("mine", table(tmp_path, files="pictures", pixels="uint16"), {})
    assert len(fine.render(scene, tmp_path / "out", Quality())) == 1


@dataclass(frozen=True)
class Plugged(ZBuffer):
    """An adapter from somebody else's package."""

    name: str = "plugged"


def test_entry_points_bring_adapters_and_a_broken_one_harms_nobody(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    points = [
        EntryPoint("plugged", f"{__name__}:Plugged", registry.GROUP),
        EntryPoint("broken", "no_such_module:adapter", registry.GROUP),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda group: points if group == registry.GROUP else [])
    monkeypatch.setitem(sys.modules, __name__, sys.modules.get(__name__) or __import__("types").ModuleType(__name__))
    monkeypatch.setattr(sys.modules[__name__], "Plugged", Plugged, raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "notabug.toml").write_text('[renderers.mine]\ncommand = ["x", "{scene}", "{image}"]\n')
    found = registry.adapters()
    assert {"plugged", "broken", "mine", "povray"} <= set(found)
    assert found["plugged"].find().version
    with pytest.raises(RendererMissingError, match="no_such_module"):
        found["broken"].find()
    with pytest.raises(NotabugError):
        found["mine"].find()


def test_the_manual_names_every_key_and_placeholder() -> None:
    manual = (Path(__file__).resolve().parents[2] / "docs" / "your-renderer.md").read_text(encoding="utf-8")
    keys = {*COMMAND_KEYS, *LIMIT_KEYS, *KEYS, "files", "adapter"}
    missing = {key for key in keys if f"`{key}`" not in manual and f"\n{key} = " not in manual}
    assert missing == set()
    assert [hole for hole in typed.PLACEHOLDERS if f"{{{hole}}}" not in manual] == []


DRAW = """
import json, pathlib, sys
import numpy as np, OpenImageIO
scene, image = map(pathlib.Path, sys.argv[1:3])
before = {each.name: each.read_bytes() for each in scene.parent.iterdir() if each.is_file()}
size = json.loads((scene.parent / "scene.json").read_text())
names = NAMES
spec = OpenImageIO.ImageSpec(int(sys.argv[3]), int(sys.argv[4]), len(names), OpenImageIO.TypeDesc("STORED"))
spec.channelnames = names
target = OpenImageIO.ImageOutput.create(str(image))
assert target.open(str(image), spec)
pixels = np.zeros((spec.height, spec.width, len(names)), np.float32)
pixels[..., -3:] = 0.25
assert target.write_image(pixels) and target.close()
assert before == {each.name: each.read_bytes() for each in scene.parent.iterdir() if each.is_file()}, "a file is gone"
assert any(each.startswith("image0") for each in before), before
"""


def drawer(folder: Path, names: tuple[str, ...], stored: str, **more: Any) -> Adapter:
    """A command renderer that looks whether all files of its scene are still there when it has drawn."""
    (folder / "draw.py").write_text(DRAW.replace("NAMES", repr(names)).replace("STORED", stored))
    command = [sys.executable, "{folder}/draw.py", "{scene}", "{image}", "{width}", "{height}", "{seed}"]
    return configured("mine", table(folder, command=command, noisy=True, **more), {})


@pytest.mark.parametrize(
    ("image", "scene", "stored", "pixels"),
    [
        ("png", "json", "uint16", "uint16"),
        ("png", "obj", "uint16", "uint16"),
        ("pfm", "json", "float", "float"),
        ("pfm", "pbrt", "float", "float"),
        ("exr", "gltf", "half", "half"),
        ("hdr", "usd", "float", "rgbe"),
    ],
)
def test_a_picture_never_takes_the_place_of_a_file_of_the_scene(
    image: str, scene: str, stored: str, pixels: str, tmp_path: Path
) -> None:
    textured = read_scene("texture/uneven_quad")
    assert textured.textures
    adapter = drawer(tmp_path, ("R", "G", "B"), stored, image=image, scene=scene, pixels=pixels)
    out = tmp_path / "out"
    out.mkdir()
    renders = adapter.render(textured, out, Quality(seeds=(0, 1)))
    assert [each.seed for each in renders] == [0, 1]
    for each in renders:
        assert read_picture(each.image).pixels == pytest.approx(0.25, abs=1e-4)


def test_a_configured_renderer_names_its_layer(tmp_path: Path) -> None:
    names = ("A.R", "A.G", "A.B", "B.R", "B.G", "B.B")
    scene, out = read_scene("texture/uneven_quad"), tmp_path / "out"
    out.mkdir()
    with pytest.raises(RendererError, match=r"several layers(.|\n)*A \(R, G, B\); B \(R, G, B\)(.|\n)*layer = "):
        drawer(tmp_path, names, "float").render(scene, out, Quality(seeds=(0,)))
    (made,) = drawer(tmp_path, names, "float", layer="B").render(scene, out, Quality(seeds=(0,)))
    assert (read_picture(made.image).pixels == 0.25).all()


def test_files_have_a_layer_too(tmp_path: Path) -> None:
    import OpenImageIO

    path = tmp_path / "pictures" / "calibration" / "card.exr"
    path.parent.mkdir(parents=True)
    (tmp_path / "out").mkdir()
    spec = OpenImageIO.ImageSpec(4, 4, 6, OpenImageIO.FLOAT)
    spec.channelnames = ("A.R", "A.G", "A.B", "B.R", "B.G", "B.B")
    target = OpenImageIO.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    assert target.write_image(np.tile(np.float32([0, 0, 0, 1, 2, 3]), (4, 4, 1)))
    assert target.close()
    scene = read_scene("calibration/card")
    with pytest.raises(RendererError, match="several layers"):
        configured("mine", table(tmp_path, files="pictures"), {}).render(scene, tmp_path / "out", Quality())
    (made,) = configured("mine", table(tmp_path, files="pictures", layer="B"), {}).render(
        scene, tmp_path / "out", Quality()
    )
    assert read_picture(made.image).pixels[0, 0].tolist() == [1.0, 2.0, 3.0]


def test_a_radiance_file_is_declared_as_it_is() -> None:
    declared = configured("mine", table(**GOOD, image="hdr"), {}).declaration(Quality())
    assert (declared.quantum, declared.relative_quantum, declared.shared_exponent) == (2.0**-7, True, True)
    assert not configured("mine", table(**GOOD), {}).declaration(Quality()).shared_exponent


RUNS = '[renderers.mine]\ncommand = ["sh"]\nversion = ["sh", "-c", "touch ran"]\n'


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("name", ["notabug.toml", "pyproject.toml"])
def test_a_configuration_of_another_user_is_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / name
    path.write_text(RUNS if name == "notabug.toml" else RUNS.replace("renderers", "tool.notabug.renderers"))
    os.chown(path, 65534, 65534)
    inner = tmp_path / "mine"
    inner.mkdir()
    with pytest.raises(ConfigError, match=r"may be somebody else's is not read; got it belongs to .*NOTABUG_CONFIG"):
        find_config(inner)
    for variable in ("NOTABUG_OWNERS", "SUDO_UID"):
        with monkeypatch.context() as patch:
            patch.setenv(variable, "65534")
            assert find_config(inner) == path
    monkeypatch.setenv("NOTABUG_CONFIG", str(path))
    assert find_config(inner) == path


def test_a_configuration_that_anybody_may_write_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notabug.toml"
    path.write_text(RUNS)
    path.chmod(0o666)
    with pytest.raises(ConfigError, match="anybody may write to it; chmod o-w"):
        find_config(tmp_path)
    path.chmod(0o664)  # a group of its own is usual
    assert find_config(tmp_path) == path


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files away")
def test_doctor_runs_no_program_that_another_user_names(tmp_path: Path) -> None:
    (tmp_path / "notabug.toml").write_text(RUNS)
    os.chown(tmp_path / "notabug.toml", 65534, 65534)
    inner = tmp_path / "mine"
    inner.mkdir()
    words = [sys.executable, "-m", "notabug", "doctor"]
    done = subprocess.run(words, cwd=inner, capture_output=True, text=True, check=False)
    assert done.returncode == 2, done.stderr
    assert "NOTABUG_OWNERS" in done.stderr
    assert not list(tmp_path.rglob("ran"))


def words_given(folder: Path, command: list[str]) -> list[str]:
    """The words that the program of ``command`` gets, by its own account; it draws nothing."""
    adapter = configured("mine", table(folder, command=command, environment={"TOLD": "{folder}/told.json"}), {})
    out = folder / "out"
    out.mkdir()
    with pytest.raises(RendererError):
        adapter.render(read_scene("calibration/plain_card"), out, Quality())
    return list(json.loads((folder / "told.json").read_text()))


TELL = "import json, os, sys\njson.dump(sys.argv, open(os.environ['TOLD'], 'w'))"


def test_a_word_that_names_a_file_beside_the_configuration_is_that_file(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(TELL)
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "colours.txt").write_text("")
    (tmp_path / "scene.json").write_text("not that of the job")
    words = ["mine.py", "lib/colours.txt", "lib", "scene.json", "other.txt", "--fast", "", "{scene}", "{image}"]
    given = words_given(tmp_path, [sys.executable, *words])
    assert given[:2] == [str(tmp_path / "mine.py"), str(tmp_path / "lib" / "colours.txt")]
    assert given[2:7] == ["lib", "scene.json", "other.txt", "--fast", ""]  # a folder, a file of the job, no file


def test_a_word_may_be_a_whole_program(tmp_path: Path) -> None:
    assert words_given(tmp_path, [sys.executable, "-c", TELL + "\n#" + "x" * 5000, "{scene}", "{image}"])[0] == "-c"
