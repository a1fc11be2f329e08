"""The reference corpus: files that are the same whenever they are built, and comparisons in units of the last place."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.exit_codes import ExitCode, exit_code
from notabug.references import store
from notabug.scenes_usd import catalogue
from notabug.scenes_usd.errors import NotabugError
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.scene import Scene


@pytest.fixture
def scene(make: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Scene:
    """A floor with a shadow, 24 x 24 pixels, whose reference goes to an empty corpus."""
    monkeypatch.setattr(store, "CORPUS", tmp_path / "corpus")
    objects = [make.rectangle(), make.rectangle(1.0, 0.3)]
    found: Scene = make.scene(objects, [make.point((0.5, 0.2, 2))], make.camera((1, -3, 4), (0, 0, 0)), size=24)
    return replace(found, variants={"height": "1"})


def test_building_twice_gives_the_same_bytes(scene: Scene) -> None:
    path = store.build(scene)
    assert path == store.CORPUS / "test" / "scene" / "height=1.exr"
    first = path.read_bytes()
    time.sleep(1.1)  # the EXR writer's clock ticks in seconds
    path.unlink()
    assert store.build(scene).read_bytes() == first
    metadata = store.read("test/scene", "height=1").metadata
    assert metadata["DateTime"] == "1970:01:01 00:00:00"
    assert not {"Software", "HostComputer", "Artist", "owner", "ImageDescription"} & set(metadata)
    assert str(path.parent.parent).encode() not in first
    assert [each.name for each in path.parent.iterdir()] == [path.name]


def test_what_is_stored_is_what_was_computed_and_says_from_what(scene: Scene) -> None:
    store.build(scene)
    stored = store.read("test/scene", "height=1")
    assert np.array_equal(stored.pixels, store.compute(scene).pixels.astype(np.float32))
    assert stored.relative_quantum
    assert stored.pixels.max() > 0
    assert stored.metadata["notabug:digest"] == scene.digest()
    assert stored.metadata["notabug:scene"] == "test/scene"
    assert stored.metadata["notabug:variant"] == "height=1"
    assert {"notabug:tracer", "notabug:samples", "notabug:versions"} <= set(stored.metadata)
    assert store.verify(scene) == []
    assert str(store.compare(scene)) == "identical"


@pytest.mark.parametrize(("ulps", "accepted"), [(1, True), (2, False), (-5, False)])
def test_differences_count_in_units_of_the_last_place(scene: Scene, ulps: int, accepted: bool) -> None:
    path = store.build(scene)
    made = store.compute(scene)
    pixels = made.pixels
    y, x = np.unravel_index(np.argmax(pixels[..., 0]), pixels.shape[:2])
    pixels[y, x, 0] = (pixels[y, x, :1].view(np.int16) + np.int16(ulps)).view(np.float16)[0]
    store.write(path, made, store.provenance(scene))
    found = store.compare(scene)
    assert (found.pixels, found.ulps, found.accepted) == (1, abs(ulps), accepted)
    assert f"1 pixels differ, at most {abs(ulps)} ulp" in str(found)
    assert ("is accepted" in str(found)) == accepted
    assert store.verify(scene) == ([] if accepted else [str(found)])


def test_a_reference_is_within_its_bound_of_very_many_samples(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    """A pixel that is not is told, and so is a file of a time before there were bounds."""
    monkeypatch.setattr(store, "PIXELS", 2 * scene.width * scene.height)  # so that every one is looked at
    path = store.build(scene)
    found = store.compare_deep(scene)
    assert found.accepted
    assert found.ratio is not None
    assert 0.0 < found.ratio <= 1.0
    assert store.read("test/scene", "height=1").judged == ("R", "G", "B")
    made = store.compute(scene)
    bound = store.read_bound("test/scene", "height=1")
    assert bound is not None
    assert np.array_equal(bound, made.bound.astype(np.float32))
    made.pixels[3, 5] *= np.float16(1.5)
    store.write(path, made, store.provenance(scene))
    wrong = store.compare_deep(scene)
    assert not wrong.accepted
    assert wrong.at == (5, 3)
    assert "the estimate of the error is wrong there" in str(wrong)
    write_exr(path, made.pixels.astype(np.float32), half=True, metadata=store.provenance(scene))
    assert not store.compare_deep(scene).accepted
    assert "run `notabug references build`" in str(store.compare_deep(scene))


@pytest.mark.parametrize(("height", "width"), [(256, 256), (128, 96), (40, 40), (20, 15)])
def test_what_is_looked_at_lies_all_over(height: int, width: int) -> None:
    """Even steps of 257 through 256 rows of 256 pixels once looked at the diagonal alone."""
    places = store.scattered(height * width, 256)
    assert places.min() >= 0
    assert places.max() < height * width
    assert len(places) > 0.9 * min(256, height * width)
    rows, columns = np.unique(places // width), np.unique(places % width)
    assert min(len(rows) / height, len(columns) / width) > 0.5
    counted, _, _ = np.histogram2d(places // width, places % width, bins=8, range=((0, height), (0, width)))
    assert counted.min() >= 1
    assert np.array_equal(store.scattered(50, 64), np.arange(50))


def test_half_floats_in_order() -> None:
    """All finite ones: each is one step above the one before it, and both zeros are the same."""
    every = np.arange(1 << 16, dtype=np.uint16).view(np.float16)
    finite = np.sort(every[np.isfinite(every)])
    steps = np.diff(store._ordered(finite))
    assert (steps[finite[1:] != finite[:-1]] == 1).all()
    assert (steps[finite[1:] == finite[:-1]] == 0).all()


def test_a_scene_that_changed(scene: Scene) -> None:
    store.build(scene)
    dimmer = replace(scene, lights=tuple(replace(each, intensity=(0.9,) * 3) for each in scene.lights))
    (problem,) = store.verify(dimmer)
    assert "the scene changed since its reference was built" in problem
    assert "notabug references build" in problem
    larger = replace(scene, width=25)
    assert not store.compare(larger).accepted
    further = replace(scene, camera=replace(scene.camera, far=scene.camera.far * 2))  # moves no pixel
    assert store.compare(further).accepted
    assert "digest" in str(store.compare(further))


def test_a_missing_reference_says_what_to_do(scene: Scene) -> None:
    with pytest.raises(
        store.ReferenceMissingError, match="notabug references build test/scene --variant height=1"
    ) as e:
        store.verify(scene)
    assert exit_code(e.value) is ExitCode.REFERENCE == 4


@pytest.mark.parametrize(
    ("name", "variant"), [("own", ""), ("../x", "a=b"), ("a/..", ""), ("a/b", "../c"), ("a/b/c", "")]
)
def test_only_scenes_of_the_corpus_have_a_place(name: str, variant: str) -> None:
    with pytest.raises(NotabugError, match="scenes of the corpus only"):
        store.place(name, variant)


def test_a_folder_that_cannot_be_written_to(scene: Scene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setattr(store, "CORPUS", tmp_path / "file" / "corpus")
    with pytest.raises(NotabugError, match=r"cannot be written to; an installed package is read-only.*checkout"):
        store.build(scene)
    monkeypatch.setattr(store, "CORPUS", tmp_path)
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(NotabugError, match="read-only"):
        store.build(scene)


def test_a_reference_too_bright_for_half_floats(scene: Scene) -> None:
    blinding = replace(scene, lights=tuple(replace(each, intensity=(1e7,) * 3) for each in scene.lights))
    with pytest.raises(NotabugError, match="65504"):
        store.build(blinding)
    assert not store.CORPUS.exists()


def test_the_corpus_is_complete_and_holds_nothing_else() -> None:
    """Every scene and variant has its picture: else `notabug references build`. No picture without its scene."""
    wanted = set()
    for entry in catalogue.scenes():
        picked = [dict(entry.defaults)]
        picked += [{**entry.defaults, key: name} for key, names in entry.variants.items() for name in names]
        wanted |= {store.place(entry.id, ",".join(f"{k}={v}" for k, v in sorted(each.items()))) for each in picked}
    assert set(store.CORPUS.rglob("*.exr")) == wanted


@pytest.mark.slow
def test_another_processor_gives_the_same_reference() -> None:
    """A libm without this processor's vector and fused instructions stands for another machine (glibc's tunables)."""
    words = ["references", "verify", "terminator/sphere", "--variant", "tessellation=8x4"]
    other = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-FMA4_Usable"}
    done = subprocess.run(
        [sys.executable, "-m", "notabug.cli", *words],
        env={**os.environ, **other}, capture_output=True, text=True, timeout=300, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # that the scene's digest is another one may follow: a third processor rounds its transforms otherwise
    assert done.stderr.strip().partition(",")[0] == "terminator/sphere tessellation=8x4: identical"
