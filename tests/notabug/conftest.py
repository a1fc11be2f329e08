"""A front door with renderers and a judge that do as they are told."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO
import pytest

import notabug.adapters.registry
import notabug.commands.doctor
import notabug.commands.listing
import notabug.commands.run
import notabug.runs.judge_files
from notabug.adapters.base import Declaration, Found, Quality, Render, RendererMissingError
from notabug.cli import main
from notabug.metrics.judge import Judgement
from notabug.metrics.verdict import Verdict
from notabug.references.predict import predict
from notabug.scenes_usd.picture import Pixels, write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene


@dataclass
class FakeRenderer:
    """Draws every scene grey, but for the cards, as they should be; ``mishaps`` maps a scene's id to what it raises."""

    name: str = "grey"
    capabilities: frozenset[str] = frozenset()
    install: str = "apt install grey"
    version: str = "1.0"
    installed: bool = True
    mishaps: dict[str, BaseException] = field(default_factory=dict)
    drawn: list[str] = field(default_factory=list)

    def declaration(self, quality: Quality) -> Declaration:
        return Declaration("float32", "box", 0.5, 2.0**-24, relative_quantum=True, noisy=len(quality.seeds) > 1)

    def find(self) -> Found:
        if not self.installed:
            raise RendererMissingError("no executable", where=f"adapter {self.name!r}", do=self.install)
        return Found(self.version, "/nowhere")

    def render(self, scene: Scene, out: Path, quality: Quality) -> tuple[Render, ...]:
        self.drawn.append(f"{scene.id} {scene.variant}".rstrip())
        if scene.id in self.mishaps:
            raise self.mishaps[scene.id]
        renders = []
        right = predict(scene).mean if scene.card.artifact_class == "calibration" else None
        picture = np.full((scene.height, scene.width, 3), 0.25) if right is None else right
        for seed in quality.seeds:
            write_exr(out / f"{seed}.exr", picture)
            renders.append(Render(out / f"{seed}.exr", seed, quality.samples or 4, 0.0, ("grey", scene.id)))
        return tuple(renders)


@dataclass
class FakeJudge:
    """Gives every scene the verdict in ``verdicts``, else a pass."""

    verdicts: dict[str, Verdict] = field(default_factory=dict)
    judged: list[str] = field(default_factory=list)

    def __call__(self, pictures: Any, scene: Scene, declaration: Declaration, **options: Any) -> Judgement:
        self.judged.append(scene.id)
        mean = np.mean(pictures, axis=0, dtype=np.float64)
        none = np.zeros(mean.shape[:2])
        return Judgement(self.verdicts.get(scene.id, Verdict("pass")), mean, mean, mean, none, none)


@dataclass
class Door:
    """The command line: call it with words; ``renderers`` are the only ones there are."""

    renderers: dict[str, FakeRenderer]
    judge: FakeJudge
    out: Path
    capture: pytest.CaptureFixture[str]
    patch: pytest.MonkeyPatch
    stdout: str = ""
    stderr: str = ""

    @property
    def grey(self) -> FakeRenderer:
        return self.renderers["grey"]

    def __call__(self, *words: str) -> int:
        self.patch.setattr(sys, "argv", ["notabug", *words])
        with pytest.raises(SystemExit) as stop:
            main()
        self.stdout, self.stderr = self.capture.readouterr()
        code = stop.value.code
        return code if isinstance(code, int) else int(code is not None)

    def run(self, *words: str) -> int:
        return self("run", "--out", str(self.out), *words)


@pytest.fixture
def door(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Door:
    renderers = {"grey": FakeRenderer()}
    judge = FakeJudge()
    there: Callable[[], dict[str, FakeRenderer]] = lambda: dict(sorted(renderers.items()))  # noqa: E731
    for module in (notabug.adapters.registry, notabug.commands.run, notabug.commands.doctor, notabug.commands.listing):
        monkeypatch.setattr(module, "adapters", there)
    monkeypatch.setattr(notabug.runs.judge_files, "judge", judge)
    monkeypatch.delenv("NOTABUG_REQUIRE", raising=False)
    monkeypatch.setenv("NOTABUG_JOBS", "1")  # other processes would not know these renderers
    monkeypatch.chdir(tmp_path)
    return Door(renderers, judge, tmp_path / "out", capsys, monkeypatch)


WIDTH, HEIGHT = 48, 36
STAGE = """#usda 1.0
(
    defaultPrim = "Scene"
    renderSettingsPrimPath = "/Render/Settings"
    upAxis = "Y"
)
def Xform "Scene" (
    customData = {
        dictionary notabug = {
            string class = "terminator"
            string claim = "A ball."
        }
    }
)
{
    def Camera "Camera"
    {
        float2 clippingRange = (0.1, 1000)
        float focalLength = 25
        float horizontalAperture = ACROSS
        float verticalAperture = DOWN
        double3 xformOp:translate = (0, 0, 4.5)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def SphereLight "Light"
    {
        float inputs:intensity = 120
        bool inputs:normalize = 1
        bool treatAsPoint = 1
        double3 xformOp:translate = (1, 2, 3)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Sphere "Ball" (
        prepend apiSchemas = ["MaterialBindingAPI"]
    )
    {
        rel material:binding = </Scene/Red>
        double radius = 1
        double3 xformOp:translate = (-0.3, 0.1, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }
    def Material "Red"
    {
        token outputs:surface.connect = </Scene/Red/S.outputs:surface>
        def Shader "S"
        {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor = (0.6, 0.2, 0.15)
            color3f inputs:specularColor = (0, 0, 0)
            int inputs:useSpecularWorkflow = 1
            token outputs:surface
        }
    }
}
def Scope "Render"
{
    def RenderSettings "Settings"
    {
        rel camera = </Scene/Camera>
        uniform int2 resolution = (WIDTH, HEIGHT)
    }
}
"""


def stage(folder: Path, width: int = WIDTH, height: int = HEIGHT, aperture: float = 20.0) -> Path:
    """A scene of that size: a lit ball before black; at an aperture of 2 the ball fills the picture."""
    longest = max(width, height)
    path = folder / f"ball{width}x{height}at{aperture:g}.usda"
    text = STAGE.replace("ACROSS", str(aperture * width / longest)).replace("DOWN", str(aperture * height / longest))
    path.write_text(text.replace("WIDTH", str(width)).replace("HEIGHT", str(height)))
    return path


NO_ATTRIBUTES: Mapping[str, Any] = {}


@dataclass
class Desk:
    """The scene, its right picture, and the command line."""

    folder: Path
    source: Path
    right: Pixels
    say: Callable[..., int]
    capture: pytest.CaptureFixture[str]
    out: str = ""
    err: str = ""

    def stage(self, width: int, height: int, aperture: float = 20.0) -> Path:
        """The scene in another size."""
        return stage(self.folder, width, height, aperture)

    def judge(self, path: Path, *words: str) -> int:
        code = self.say("judge", str(path), "--scene", str(self.source), "--filter", "box", "--samples", "16", *words)
        self.out, self.err = self.capture.readouterr()
        return code

    def result(self, path: Path, *words: str) -> dict[str, Any]:
        self.judge(path, "--json", *words)
        found: dict[str, Any] = json.loads(self.out)["results"][0]
        return found

    def write(
        self,
        name: str,
        pixels: Any,
        stored: str = "float",
        attributes: Mapping[str, Any] = NO_ATTRIBUTES,
        **fields: Any,
    ) -> Path:
        """A file whose ImageSpec has ``fields``; with ``channelnames`` as many channels as they are."""
        data = np.ascontiguousarray(pixels, np.float32)
        spec = OpenImageIO.ImageSpec(data.shape[1], data.shape[0], data.shape[2], OpenImageIO.TypeDesc(stored))
        for key, value in attributes.items():
            spec.attribute(key, value)
        for key, value in fields.items():
            setattr(spec, key, value)
        path = self.folder / name
        target = OpenImageIO.ImageOutput.create(str(path))
        assert target.open(str(path), spec), target.geterror()
        assert target.write_image(data), target.geterror()
        assert target.close()
        return path

    def parts(self, name: str, parts: Mapping[str, tuple[tuple[str, ...], Any]]) -> Path:
        """A multi-part EXR: part name to channel names and pixels."""
        specs = []
        for part, (names, pixels) in parts.items():
            spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], len(names), OpenImageIO.FLOAT)
            spec.channelnames = names
            spec.attribute("oiio:subimagename", part)
            specs.append(spec)
        path = self.folder / name
        target = OpenImageIO.ImageOutput.create(str(path))
        assert target.open(str(path), specs)
        for number, (_, pixels) in enumerate(parts.values()):
            assert not number or target.open(str(path), specs[number], "AppendSubimage")
            assert target.write_image(np.ascontiguousarray(pixels, np.float32))
        assert target.close()
        return path


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Desk:
    source = stage(tmp_path)

    def say(*words: str) -> int:
        monkeypatch.setattr(sys, "argv", ["notabug", *words])
        with pytest.raises(SystemExit) as stop:
            main()
        return int(stop.value.code or 0)

    right = np.array(predict(read_scene(str(source))).mean, np.float32)
    return Desk(tmp_path, source, right, say, capsys)
