"""POV-Ray alone: what only it can do, its text, and how it fails."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from notabug.adapters.base import Quality, RendererError, RendererMissingError, UnsupportedError
from notabug.adapters.povray import PovRay
from notabug.adapters.povray_scene import scene_text
from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.picture import read_picture
from notabug.scenes_usd.scene import Sphere

HALF_STEP = 0.51 / 65535


def floor(stage: Any, **look: Any) -> Any:
    return stage.scene(
        [stage.quad()],
        [stage.point((0.5, 0.3, 2.0))],
        stage.camera((0, -3, 4)),
        [stage.replace(stage.grey(0.5), **look)],
    )


@pytest.mark.parametrize("lobe", ["phong", "blinn"])
@pytest.mark.parametrize("opacity", [1.0, 0.25])
@pytest.mark.sweep_except("1.0-blinn", "0.25-phong")
def test_highlight(stage: Any, povray: PovRay, lobe: str, opacity: float) -> None:
    scene = floor(stage, specular=(0.4,) * 3, exponent=24.0, lobe=lobe, opacity=opacity)
    picture = stage.draw(povray, scene)[..., 0]
    light = scene.lights[0]
    P, N = stage.on_plane(scene), np.array([0.0, 0.0, 1.0])
    _, D = stage.rays(scene)
    L = np.array(light.position) - P
    L /= np.linalg.norm(L, axis=-1, keepdims=True)
    H = L - D
    H /= np.linalg.norm(H, axis=-1, keepdims=True)
    R = 2 * (L @ N)[..., None] * N - L
    cosine = np.maximum(-(R * D).sum(-1), 0) if lobe == "phong" else np.maximum(H @ N, 0)
    E, lambert = stage.lit(P, N, light)
    expected = opacity * E / np.pi * (0.5 * lambert + 0.4 * cosine**24)
    assert np.abs(picture - expected).max() < HALF_STEP + 2e-6


def test_opaque_and_transparent_crossings_of_a_sphere(stage: Any, povray: PovRay) -> None:
    """The floor below a sphere of opacity 0.5 gets a quarter of the light: both of its sides attenuate."""
    ball = Sphere("/Scene/Ball", 0.5, 1, np.diag([1.0, 1.0, 1.0, 1.0]) + np.eye(4, k=-1) * 0)
    ball.to_world[3, :3] = 1.2, 0, 1.0
    light = stage.distant((0, 0, 1), (np.pi,) * 3)
    scene = stage.scene(
        [stage.quad(), ball],
        [light],
        stage.camera((-4, 0, 1.5), (1.2, 0, 0)),
        [stage.grey(0.8), stage.replace(stage.grey(0), opacity=0.5)],
    )
    picture = stage.draw(povray, scene)[..., 0]
    P = stage.on_plane(scene)
    below = np.hypot(P[..., 0] - 1.2, P[..., 1])
    seen, _, _ = stage.on_sphere(scene, ball)
    assert picture[(below < 0.48) & ~seen] == pytest.approx(0.2, abs=2e-5)
    assert picture[(below > 0.52) & (np.abs(P) < 8).all(-1) & ~seen] == pytest.approx(0.8, abs=2e-5)


def test_sheared_sphere(stage: Any, povray: PovRay) -> None:
    matrix = np.eye(4)
    matrix[:3, :3] = [[1.2, 0.3, 0], [0, 0.5, 0.2], [-0.4, 0, 0.8]]
    matrix[3, :3] = 0.1, 0.2, 0.3
    ball, light = Sphere("/Scene/Egg", 1.3, 0, matrix), stage.distant((0.5, 0.2, 1))
    scene = stage.scene([ball], [light], stage.camera((1, -1, 4)))
    picture = stage.draw(povray, scene)[..., 0]
    hit, P, N = stage.on_sphere(scene, ball)
    E, cosine = stage.lit(P, N, light)
    expected = np.where(hit, 0.8 / np.pi * E * cosine, 0)
    assert ((picture > 0) != (expected > 0)).sum() <= 2
    both = (picture > 0) & (expected > 0)
    assert np.abs(picture - expected)[both].max() < HALF_STEP + 1e-6


def test_bright_and_dim_pictures_keep_their_values(stage: Any, povray: PovRay) -> None:
    light = stage.point((0.5, 0.3, 2.0), (600.0, 6.0, 0.006))
    scene = stage.replace(floor(stage), lights=(light,))
    picture = stage.draw(povray, scene)
    P, N = stage.on_plane(scene), np.array([0.0, 0.0, 1.0])
    E, cosine = stage.lit(P, N, light)
    expected = 0.5 * E * cosine / np.pi
    assert expected.max() > 20
    assert np.abs(picture[..., 0] / expected - 1).max() < 6e-5 + HALF_STEP / expected.min()
    assert np.abs(picture[..., 1] - expected / 100).max() < HALF_STEP + 1e-6
    dim = stage.draw(povray, stage.replace(scene, lights=(stage.replace(light, intensity=(0.006,) * 3),)))
    assert np.abs(dim[..., 0] - expected * 1e-5).max() < HALF_STEP / 1024


def test_more_samples_are_the_box_average_of_a_larger_picture(stage: Any, povray: PovRay) -> None:
    ball = Sphere("/Scene/Ball", 1.0, 0, np.eye(4))
    scene = stage.scene([ball], [stage.distant((0.2, 0.1, 1))], stage.camera((0, 0, 4)), size=(24, 16))
    fine = stage.draw(povray, stage.replace(scene, width=72, height=48))
    assert povray.declaration(Quality(9)).filter == "box"
    (render,) = povray.render(scene, stage.out, Quality(samples=9, seeds=(5, 6)))
    assert (render.seed, render.samples) == (5, 9)
    expected = fine.reshape(16, 3, 24, 3, 3).mean(axis=(1, 3))
    assert np.abs(read_picture(render.image).pixels - expected).max() < 1e-7


def test_shadows_can_be_left_out(stage: Any, povray: PovRay) -> None:
    scene = stage.scene(
        [stage.quad(), stage.quad(1.0, (0, 0, 1))], [stage.distant((1, 0, 1))], stage.camera((0, -3, 4)), size=(32, 32)
    )
    assert (stage.draw(povray, scene) == 0).any()
    assert (stage.draw(PovRay(shadows=False), scene)[4:] > 0).all()


def test_the_users_own_settings_change_nothing(stage: Any, povray: PovRay, monkeypatch: pytest.MonkeyPatch) -> None:
    plain = stage.draw(povray, floor(stage))
    ini = stage.out / "mine.ini"
    ini.write_text("Antialias=on\nOutput_File_Type=T\nWidth=8\nHeight=8\n")
    monkeypatch.setenv("POVINI", str(ini))
    assert np.array_equal(stage.draw(povray, floor(stage)), plain)


def test_names_never_reach_the_text(stage: Any) -> None:
    evil = '/Scene/x"} #include "/etc/passwd" $(touch bad)'
    scene = stage.scene(
        [stage.replace(stage.quad(), path=evil), Sphere(evil, 1.0, 0, np.eye(4))],
        [stage.replace(stage.point((0, 0, 3)), path=evil)],
        stage.camera((0, 0, 5)),
        [stage.replace(stage.grey(), path=evil)],
    )
    text = scene_text(stage.replace(scene, id=evil))
    assert text.isascii()
    assert not set('"$;') & set(text.replace("#version 3.7;", ""))
    assert "np." not in text
    assert "passwd" not in text


def test_numbers_that_are_not_finite_are_refused(stage: Any) -> None:
    quad = stage.quad()
    quad.points[2, 0] = np.nan
    with pytest.raises(SceneError, match="not finite"):
        scene_text(stage.scene([quad], [], stage.camera((0, 0, 5))))
    with pytest.raises(SceneError, match="not finite"):
        scene_text(floor(stage, exponent=np.inf, specular=(1.0, 1.0, 1.0)))


def test_what_it_cannot_draw_is_named(stage: Any) -> None:
    scene = floor(stage, specular=(0.1, 0.1, 0.1), cosine_weighted=True)
    with pytest.raises(UnsupportedError, match="cosine_weighted"):
        PovRay().render(scene, stage.out, Quality())
    assert not list(stage.out.iterdir())


def test_missing_program_says_how_to_get_it(stage: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(stage.out))
    for use in (PovRay().find, lambda: PovRay().render(floor(stage), stage.out, Quality())):
        with pytest.raises(RendererMissingError, match="apt install povray"):
            use()


def test_found(povray: PovRay) -> None:
    assert povray.find().version.startswith("3.")


def program(folder: Path, script: str) -> str:
    path = folder / "fake-povray"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


@pytest.mark.parametrize("failures", [1, 3])
def test_povray_whose_threads_did_not_start_is_started_again(stage: Any, failures: int, povray: PovRay) -> None:
    count = stage.out / "count"
    script = f"""
        echo x >> "{count}"
        if [ "$(wc -l < "{count}")" -le {failures} ]; then
            echo "Timed out waiting for worker thread startup" >&2; exit 1
        fi
        exec {povray.command} "$@" """
    render = PovRay(command=program(stage.out, script)).render(floor(stage), stage.out, Quality())
    assert len(count.read_text().split()) >= failures + 1
    assert render[0].image.is_file()


def test_povray_whose_threads_never_start_is_an_error(stage: Any) -> None:
    script = 'echo "Timed out waiting for worker thread startup" >&2; exit 1'
    with pytest.raises(RendererError, match=r"(?s)exit code 1.*worker thread startup"):
        PovRay(command=program(stage.out, script)).render(floor(stage), stage.out, Quality())


def test_another_program_of_that_name(tmp_path: Path) -> None:
    with pytest.raises(RendererMissingError, match=r"does not answer as POV-Ray 3.7.*got hello"):
        PovRay(command=program(tmp_path, "echo hello")).find()
    with pytest.raises(RendererMissingError, match=r"got POV-Ray 3\.6\.1"):
        PovRay(command=program(tmp_path, "echo POV-Ray 3.6.1 >&2")).find()


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("echo done", "left no picture"),
        ("echo cannot parse >&2; exit 3", r"exit code 3(.|\n)*cannot parse"),
        ("kill -SEGV $$", "SIGSEGV"),
        ("sleep 1000", "time limit"),
        ("echo nonsense > shot0.png", "not a picture"),
    ],
)
def test_program_that_fails(stage: Any, script: str, message: str) -> None:
    (stage.out / "povray-seed0.exr").write_text("the picture of another run")
    adapter = PovRay(command=program(stage.out, script))
    with pytest.raises(RendererError, match=message):
        adapter.render(floor(stage), stage.out, Quality(timeout=0.5 if "sleep" in script else 60.0))
    assert not (stage.out / "povray-seed0.exr").exists()
