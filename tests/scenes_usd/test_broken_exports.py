"""A scene as a tool exported it with much that is broken: each fact is told once, by prim path, in the same words."""

from __future__ import annotations

import threading
from pathlib import Path

import numpy as np
import pytest

from notabug.cli import main
from notabug.scenes_usd.adapted import adapt
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import survey_scene
from notabug.scenes_usd.reading import Remark
from notabug.scenes_usd.view import AS_IT_IS

HEAD = '#usda 1.0\n(\n    defaultPrim = "World"\n    {layers}\n)\n'
SCENE = """def Xform "World" {references}
{
    def Xform "Turned"
    {
        double3 xformOp:translate = (0, 0, 0)
        uniform token[] xformOpOrder = ["xformOp:translate", "!invert!xformOp:translate", "xformOp:rotateXYZ:gone"]
        def Mesh "Flat"
        {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
            normal3f[] NORMALS
            uniform token subdivisionScheme = "none"
        }
        def Mesh "Torn"
        {
            int[] faceVertexCounts = [3, 2]
            int[] faceVertexIndices = [0, 1, 7, 0, 1]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
        }
        def Sphere "Bare"
        {
            rel material:binding = </World/Looks/Gone>
        }
        def Sphere "Lit"
        {
            rel material:binding = </World/Lamp>
        }
    }
    def PortalLight "Portal"
    {
    }
    def RectLight "Lamp"
    {
        asset inputs:texture:file = @./gobo.png@
    }
    def RectLight "Other"
    {
    }
    def Volume "Smoke"
    {
        rel field:density = </World/Smoke/Density>
        def OpenVDBAsset "Density"
        {
            asset filePath = @./smoke.vdb@
        }
    }
}
"""
NORMALS = "normals = [(0, 0, 1), (0, 0, 0), (0, 0, 1)]"


def scene(folder: Path, *, layers: str = "", references: str = "", normals: str = NORMALS) -> Path:
    path = folder / "export.usda"
    body = SCENE.replace("{references}", references).replace("NORMALS", normals)
    path.write_text(HEAD.replace("{layers}", layers) + body)
    return path


def composed_of_nothing(folder: Path) -> Path:
    """The scene with a layer and two references that are not there."""
    return scene(folder, layers="subLayers = [@./gone.usda@]", references="(references = [@./a.usda@, @./b.usda@])")


def remarks(path: Path) -> tuple[Remark, ...]:
    return survey_scene(str(path), {}).remarks


def said(path: Path, where: str) -> list[str]:
    return [remark.what for remark in remarks(path) if remark.where == where]


def shown(words: list[str], capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> str:
    """What the command line prints, with what OpenUSD prints by itself."""
    monkeypatch.setattr("sys.argv", ["notabug", *words])
    with pytest.raises(SystemExit):
        main()
    captured = capfd.readouterr()
    return captured.out + captured.err


@pytest.mark.parametrize("command", ["check", "adapt", "run", "judge"])
def test_openusd_prints_nothing_by_itself(
    command: str, tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, picture = composed_of_nothing(tmp_path), tmp_path / "p.exr"
    write_exr(picture, np.zeros((16, 16, 3), np.float32))
    words = {
        "check": ["check", str(path)],
        "adapt": ["adapt", str(path), "--out", str(tmp_path / "own.usda")],
        "run": ["run", str(path), "--renderer", "inhouse", "--out", str(tmp_path / "run")],
        "judge": ["judge", str(picture), "--scene", str(path)],
    }
    text = shown(words[command], capfd, monkeypatch)
    assert "Warning" not in text
    assert "stage.cpp" not in text
    assert "@anon" not in text
    assert "0x" not in text
    for missing in ("gone.usda", "a.usda", "b.usda"):
        assert f"/{missing}@" in text, "each thing that is missing is told"


def test_the_listener_goes_with_the_reading(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from pxr import Usd

    remarks(composed_of_nothing(tmp_path))
    capfd.readouterr()
    opened = threading.Thread(target=lambda: Usd.Stage.Open(str(tmp_path / "export.usda")))
    opened.start()
    opened.join()
    assert "gone.usda" in capfd.readouterr().err, "who uses OpenUSD beside us hears of its own stages"


def test_an_op_that_is_not_there_is_told(tmp_path: Path) -> None:
    found = said(scene(tmp_path), "/World/Turned.xformOpOrder")
    assert found == ["names xformOp:rotateXYZ:gone, which the prim lacks: placed without it"]


def test_a_light_that_is_not_read_is_listed(tmp_path: Path) -> None:
    (what,) = said(scene(tmp_path), "/World/Portal")
    assert what.startswith("PortalLight")


def test_one_fact_is_one_remark(tmp_path: Path) -> None:
    path = scene(tmp_path)
    for name, what in (("Bare", "bound to a material that does not exist"), ("Lit", "bound to what is no material")):
        assert said(path, f"/World/Turned/{name}.material:binding") == [what]
    assert not said(path, "/World/Smoke/Density")
    assert said(path, "/World/Smoke") == ["Volume: nothing of it is drawn"]


def test_what_is_drawn_by_its_direct_light_only_is_one_line(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    text = shown(["check", str(scene(tmp_path))], capfd, monkeypatch)
    (line,) = [line for line in text.splitlines() if "direct light only" in line]
    assert line.endswith("of 2 lights and materials: /World/Lamp, /World/Other")


def test_judge_prints_the_list_and_the_next_step_of_check(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    picture = tmp_path / "p.exr"
    write_exr(picture, np.zeros((16, 16, 3), np.float32))
    for path in (scene(tmp_path), composed_of_nothing(tmp_path)):
        check = shown(["check", str(path)], capfd, monkeypatch)
        judge = shown(["judge", str(picture), "--scene", str(path)], capfd, monkeypatch)
        assert "SCENE" not in check + judge
        faults = [line.removeprefix("✗ out of the contract: ") for line in check.splitlines() if line[0] == "✗"]
        told = [line.removeprefix("notabug: ") for line in judge.splitlines() if line.startswith("notabug: ")]
        assert sorted(told) == sorted(faults)
        assert check[check.index("next: ") :] == judge[judge.index("next: ") :]


@pytest.mark.parametrize(
    "normals",
    [
        NORMALS,
        'primvars:normals = [(0, 0, 0)] (interpolation = "constant")',
        "normals = [(0, 0, 1), (0, 0, 1)]",
        'primvars:normals = [(0, 0, 1)] (interpolation = "faceVarying")\nint[] primvars:normals:indices = [0, 0, 4]',
    ],
)
def test_bad_normals_cost_a_mesh_its_normals_and_no_more(normals: str, tmp_path: Path) -> None:
    path = scene(tmp_path, normals=normals)
    made = adapt(path, tmp_path / "own.usda", {}, AS_IT_IS)
    assert made.survey.scene is not None
    (mesh,) = made.survey.scene.meshes
    assert mesh.path == "/World/Turned/Flat"
    assert mesh.normals is None
    assert len(made.says) == len(set(made.says))


def test_a_mesh_that_cannot_be_drawn_is_counted_by_run_also_of_a_written_layer(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, layer = scene(tmp_path), tmp_path / "own.usda"
    made = adapt(path, layer, {}, AS_IT_IS)
    assert made.survey.scene is not None
    assert made.survey.scene.left_out == ("/World/Turned/Torn",)
    (says,) = [line for line in made.says if "Torn" in line]
    assert says.endswith("invisible, was inherited (left out: faceVertexCounts: face 1 has 2 corners)")
    assert any(line.endswith("inputs:texture:file: empty, was ./gobo.png") for line in made.says)
    for source in (path, layer):
        words = ["run", str(source), "--renderer", "inhouse", "--out", str(tmp_path / source.stem)]
        text = shown(words, capfd, monkeypatch)
        assert "1 object cannot be drawn and is left out of the picture: /World/Turned/Torn" in text
