"""Mitsuba alone: samples and seeds, what it cannot do, and how it fails."""

from __future__ import annotations

import importlib.metadata
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import notabug.adapters.mitsuba
from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.llvm import VARIABLE, Library
from notabug.adapters.mitsuba import Mitsuba
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Sphere


def floor(stage: Any, **look: Any) -> Any:
    return stage.scene(
        [stage.quad()],
        [stage.point((0.5, 0.3, 2.0))],
        stage.camera((0, -3, 4)),
        [stage.replace(stage.grey(0.5), **look)],
        size=(32, 32),
    )


def test_seeds_are_independent_and_repeatable(stage: Any, mitsuba: Mitsuba) -> None:
    ball = Sphere("/Scene/Ball", 1.0, 0, np.eye(4))
    scene = stage.scene([ball], [stage.distant((0.2, 0.1, 1))], stage.camera((0, 0, 4)), size=(32, 32))
    renders = mitsuba.render(scene, stage.out, Quality(samples=16, seeds=(0, 1, 7)))
    assert [each.seed for each in renders] == [0, 1, 7]
    assert {each.samples for each in renders} == {16}
    first, second, third = (read_picture(each.image).pixels for each in renders)
    assert not np.array_equal(first, second)
    assert not np.array_equal(second, third)
    (again,) = mitsuba.render(scene, stage.out, Quality(samples=16, seeds=(7,)))
    assert np.array_equal(read_picture(again.image).pixels, third)
    edge = (first > 0) & (first < 0.1)
    assert np.abs(first - second)[edge].mean() > 3 * np.abs(first - second)[10:20, 10:20].mean()
    declared = mitsuba.declaration(Quality())
    assert (declared.filter, declared.radius, declared.noisy) == ("box", 0.5, True)


def test_pixel_centres_are_drawn_once(stage: Any, mitsuba: Mitsuba) -> None:
    renders = mitsuba.render(floor(stage), stage.out, Quality(samples=1, seeds=(3, 4)))
    assert len(renders) == 1
    assert not mitsuba.declaration(Quality(samples=1)).noisy


def test_without_llvm_the_picture_is_the_same(stage: Any, mitsuba: Mitsuba, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = floor(stage)
    fast = stage.draw(mitsuba, scene)
    monkeypatch.setattr(notabug.adapters.mitsuba, "find_library", lambda: Library(None, "no LLVM >= 19"))
    assert np.abs(stage.draw(mitsuba, scene) - fast).max() < 1e-6
    (remark,) = mitsuba.find().remarks
    assert "scalar_rgb" in remark
    assert "apt install libllvm19" in remark


def test_scenes_without_lights_or_objects_are_black(stage: Any, mitsuba: Mitsuba) -> None:
    assert not stage.draw(mitsuba, stage.replace(floor(stage), lights=())).any()
    assert not stage.draw(mitsuba, stage.replace(floor(stage), objects=())).any()


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    scene = floor(stage)
    egg = Sphere("/Scene/Egg", 1.0, 0, np.diag([1.0, 1.0, 1.1, 1.0]))
    with pytest.raises(UnsupportedError, match=r"/Scene/Egg.*povray"):
        Mitsuba().render(stage.replace(scene, objects=(egg,)), stage.out, Quality())
    with pytest.raises(UnsupportedError, match="square"):
        Mitsuba().render(stage.replace(scene, width=33), stage.out, Quality())


def test_missing_package_says_how_to_get_it(stage: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    def version(name: str) -> str:
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    for use in (Mitsuba().find, lambda: Mitsuba().render(floor(stage), stage.out, Quality())):
        with pytest.raises(RendererMissingError, match=r"pip install notabug\[mitsuba\].*apt install libllvm19"):
            use()


def python(folder: Path, script: str) -> str:
    path = folder / "fake-python"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


def test_abort_in_llvm_is_drawn_again_without(
    stage: Any, mitsuba: Mitsuba, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(notabug.adapters.mitsuba, "find_library", lambda: Library(Path("/none/libLLVM-19.so")))
    script = f'[ -n "${VARIABLE}" ] && echo LLVM ERROR: Cannot select && kill -ABRT $$\nexec {sys.executable} "$@"'
    adapter = Mitsuba(python=python(tmp_path, script))
    (render,) = adapter.render(floor(stage), stage.out, Quality(samples=1))
    assert "ended with SIGABRT; drawn again with scalar_rgb" in render.log
    assert "Cannot select" in render.log
    assert read_picture(render.image).pixels.max() > 0


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("echo done", "left no picture"),
        ("echo ImportError >&2; exit 1", r"exit code 1(.|\n)*ImportError"),
        ("kill -ABRT $$", "SIGABRT"),
        ("sleep 1000", "time limit"),
    ],
)
def test_child_that_fails(stage: Any, mitsuba: Mitsuba, script: str, message: str) -> None:
    (stage.out / "mitsuba-seed0.exr").write_text("the picture of another run")
    adapter = Mitsuba(python=python(stage.out, script))
    with pytest.raises(RendererError, match=message):
        adapter.render(floor(stage), stage.out, Quality(seeds=(0,), timeout=0.5 if "sleep" in script else 60.0))
    assert not (stage.out / "mitsuba-seed0.exr").exists()


def test_adapters_are_listed_without_importing_their_renderers() -> None:
    code = (
        "import sys, notabug.adapters.mitsuba, notabug.adapters.mitsuba_bsdf, notabug.adapters.povray\n"
        "print(sorted({'mitsuba', 'drjit', 'OpenImageIO'} & set(sys.modules)))"
    )
    told = subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
