"""Pictures in every number format, with alpha, and of a single pixel; each with the verdict it must get."""

from __future__ import annotations

import functools
from collections.abc import Callable
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest

from notabug.adapters.base import Declaration
from notabug.commands.judge import declare
from notabug.metrics.judge import judge
from notabug.metrics.policy import POLICY
from notabug.references.predict import predict
from notabug.runs.judge_files import judge_pictures
from notabug.scenes_usd.picture import Picture, read_picture, write_coded, write_exr
from notabug.scenes_usd.reader import read_scene
from notabug.scenes_usd.scene import Scene
from notabug.scenes_usd.srgb import encode_srgb

Pixels = npt.NDArray[np.float32]
WIDTH, HEIGHT = 48, 36  # of the scene on the desk


def half_tiff(path: Path, pixels: Pixels) -> Path:
    """A TIFF of 16-bit floats, which OpenImageIO reads and does not write."""
    import struct

    height, width, channels = pixels.shape
    data = pixels.astype("<f2").tobytes()
    bits = 8 + len(data)
    ifd = bits + 12
    tags = [(256, 4, 1, width), (257, 4, 1, height), (258, 3, 3, bits), (259, 3, 1, 1), (262, 3, 1, 2), (273, 4, 1, 8)]
    tags += [(277, 3, 1, channels), (278, 4, 1, height), (279, 4, 1, len(data)), (339, 3, 3, bits + 6)]
    path.write_bytes(
        struct.pack("<2sHI", b"II", 42, ifd)
        + data
        + struct.pack("<6H", 16, 16, 16, 3, 3, 3)
        + struct.pack("<H", len(tags))
        + b"".join(struct.pack("<HHII", *each) for each in tags)
        + bytes(4)
    )
    return path


def rounded_rgbe(path: Path, pixels: Pixels) -> Path:
    """A Radiance file of a writer that rounds to the nearest step, upwards too."""
    height, width, _ = pixels.shape
    largest = pixels.max(axis=2)
    exponent = np.where(largest > 0, np.frexp(largest * (1 + 1 / 510))[1], -128)
    mantissa = np.rint(pixels / np.exp2(exponent - 8.0)[..., None]).clip(0, 255)
    data = np.concatenate([mantissa, (exponent + 128)[..., None]], axis=2).astype(np.uint8)
    path.write_bytes(f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + data.tobytes())
    return path


@pytest.fixture
def words_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bugs get no name, which takes long: what a bug is called has no say in the word."""
    monkeypatch.setattr("notabug.runs.judge_files.judge", functools.partial(judge, naming=False))


def jpeg(quality: int, sampling: str = "4:2:0") -> dict[str, str]:
    return {"Compression": f"jpeg:{quality}", "jpeg:subsampling": sampling}


class TestNumbers:
    """The right picture in every number format, and bugs in it."""

    EXACT: ClassVar[dict[str, Callable[[Any, Pixels], Path]]] = {
        "hdr": lambda desk, pixels: desk.write("a.hdr", pixels),
        "hdr, rounded": lambda desk, pixels: rounded_rgbe(desk.folder / "b.hdr", pixels),
        "half exr": lambda desk, pixels: desk.write("a.exr", pixels, "half"),
        "half as float": lambda desk, pixels: desk.write("b.exr", pixels.astype(np.float16)),
        "half tiff": lambda desk, pixels: half_tiff(desk.folder / "h.tif", pixels),
        "double tiff": lambda desk, pixels: desk.write("d.tif", pixels, "double"),
        "8 bits as float": lambda desk, pixels: desk.write("e.exr", np.rint(pixels.clip(0, 1) * 255) / 255),
        "10 bits": lambda desk, pixels: desk.write("a.dpx", pixels, "uint16", {"oiio:BitsPerSample": 10}),
        "12 bits": lambda desk, pixels: desk.write("b.dpx", pixels, "uint16", {"oiio:BitsPerSample": 12}),
        "10 bits in tiff": lambda desk, pixels: desk.write("t.tif", pixels, "uint16", {"oiio:BitsPerSample": 10}),
        "pxr24": lambda desk, pixels: desk.write("p.exr", pixels, "float", {"compression": "pxr24"}),
    }
    LOSSY: ClassVar[dict[str, Callable[[Any, Pixels], Path]]] = {
        "jpeg 95": lambda desk, pixels: desk.write("a.jpg", pixels, "uint8", jpeg(95)),
        "jpeg 75": lambda desk, pixels: desk.write("b.jpg", pixels, "uint8", jpeg(75)),
        "jpeg 60, 4:4:4": lambda desk, pixels: desk.write("c.jpg", pixels, "uint8", jpeg(60, "4:4:4")),
        "dwaa": lambda desk, pixels: desk.write("d.exr", pixels, "half", {"compression": "dwaa:45"}),
        "dwab": lambda desk, pixels: desk.write("e.exr", pixels, "float", {"compression": "dwab:200"}),
        "b44": lambda desk, pixels: desk.write("f.exr", pixels, "half", {"compression": "b44"}),
        "webp": lambda desk, pixels: desk.write("g.webp", pixels, "uint8"),
    }

    @pytest.mark.parametrize("kind", EXACT)
    def test_the_right_picture_passes(self, kind: str, desk: Any) -> None:
        assert desk.judge(self.EXACT[kind](desk, desk.right)) == 0
        assert "pass" in desk.out

    @pytest.mark.parametrize("kind", LOSSY)
    def test_what_a_coding_lost_is_no_bug(self, kind: str, desk: Any) -> None:
        assert desk.judge(self.LOSSY[kind](desk, desk.right)) == 0
        assert "pass" in desk.out or "holds too little" in desk.out

    @pytest.mark.parametrize("kind", [*EXACT, *LOSSY])
    def test_a_bug_far_outside_is_a_bug(self, kind: str, desk: Any, words_only: None) -> None:
        write = (self.EXACT | self.LOSSY)[kind]
        half = desk.right.copy()
        half[:, : WIDTH // 2] = 0.0
        assert desk.judge(write(desk, half)) == 1
        if kind in ("hdr", "jpeg 60, 4:4:4"):  # the coarsest that is exact, and the coarsest that is lossy
            assert desk.judge(write(desk, np.roll(desk.right, 4, axis=1))) == 1

    def test_eight_bits_that_came_as_float_are_told(self, desk: Any) -> None:
        for name, step in (("8 bits as float", 1 / 255), ("half as float", 2.0**-11)):
            picture = read_picture(self.EXACT[name](desk, desk.right))
            assert picture.quantum == step, name

    def test_jpeg_of_encoded_values(self, desk: Any) -> None:
        path = desk.write("s.jpg", encode_srgb(desk.right), "uint8", jpeg(90))
        assert desk.judge(path, "--encoding", "srgb") == 0
        dark = desk.write("t.jpg", encode_srgb(desk.right * 0.5), "uint8", jpeg(90))
        assert desk.judge(dark, "--encoding", "srgb") == 1

    @pytest.mark.parametrize("encoding", ["gamma22", "sRGB-ish", "", "log"])
    def test_an_encoding_that_there_is_not(self, encoding: str, desk: Any) -> None:
        path = desk.write("plain.exr", desk.right)
        assert desk.judge(path, "--encoding", encoding) == 2
        assert "srgb" in desk.err


class TestAlpha:
    """Alpha, straight and associated."""

    @staticmethod
    def straight(right: Pixels) -> tuple[Pixels, Pixels]:
        """Colours and coverage of which ``right`` is the product: a soft disc."""
        y, x = np.mgrid[:HEIGHT, :WIDTH]
        alpha = (1.2 - np.hypot(x / WIDTH - 0.5, y / HEIGHT - 0.5)).clip(0.3, 1.0).astype(np.float32)[..., None]
        return right / alpha, alpha

    def test_straight_alpha_is_multiplied_in_linear_light(self, desk: Any) -> None:
        colours, alpha = self.straight(desk.right * 0.5)
        desk.right *= 0.5
        for name, words, encode in (("l.png", (), np.float32), ("s.png", ("--encoding", "srgb"), encode_srgb)):
            stored = np.concatenate([encode(colours), alpha], axis=2)
            path = desk.write(name, stored, "uint16", {"oiio:UnassociatedAlpha": 1}, alpha_channel=3)
            picture = read_picture(path, srgb=bool(words))
            np.testing.assert_allclose(picture.pixels, desk.right, atol=2e-4)
            desk.judge(path, *words)
            assert "alpha is straight" in desk.out

    def test_associated_alpha_leaves_colours_alone(self, desk: Any) -> None:
        _, alpha = self.straight(desk.right)
        path = desk.write("a.exr", np.concatenate([desk.right, alpha], axis=2), alpha_channel=3)
        assert desk.judge(path) == 0
        assert "alpha" not in desk.out

    @pytest.mark.parametrize("value", [0.0, 1.0])
    @pytest.mark.parametrize("name", ["a.png", "a.tif", "a.tga"])
    def test_alpha_that_says_nothing(self, name: str, value: float, desk: Any) -> None:
        alpha = np.full((HEIGHT, WIDTH, 1), value, np.float32)
        stored = np.concatenate([desk.right, alpha], axis=2)
        path = desk.write(name, stored, "uint8", {"oiio:UnassociatedAlpha": 1}, alpha_channel=3)
        assert desk.judge(path) == 0
        assert ("alpha is 0 everywhere" in desk.out) == (value == 0.0)


SIZES = [(1, 1), (1, 64), (64, 1), (1, 300), (2, 2), (3, 1), (1, 2), (2, 1)]


def verdict_of(pixels: list[Pixels], scene: Scene, **declared: Any) -> str:
    pictures = [Picture(each, 3, 2.0**-24, relative_quantum=True, metadata={}) for each in pixels]
    declaration: Declaration = declare(
        pictures,
        declared.get("filter_name", "unknown"),
        None,
        "float32",
        srgb=False,
        noisy=None,
        samples=declared.get("samples", 0),
    )
    return judge_pictures([Path()] * len(pixels), scene, declaration, None, pictures=pictures).verdict.word


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.sweep_except("size0", "size2", "size3", "size4", "size5")
def test_pictures_of_a_pixel_or_a_line(size: tuple[int, int], desk: Any, words_only: None) -> None:
    scene = read_scene(str(desk.stage(*size)))
    envelope = predict(scene)
    rng = np.random.default_rng(0)
    for name, right in (("box", envelope.mean), ("point", envelope.point), ("gaussian", envelope.mean)):
        pixels = np.asarray(right, np.float32)
        for samples in (0, 64):
            assert verdict_of([pixels], scene, filter_name=name, samples=samples) in ("pass", "limitation"), name
        if pixels.size > 3 * POLICY.excused.budget:  # of fewer pixels any may lie beside an edge and be off
            assert verdict_of([pixels * 3.0 + 0.5], scene, filter_name=name) == "bug", name
        noisy = [np.asarray(pixels * (1.0 + 0.05 * rng.standard_normal(pixels.shape)), np.float32) for _ in range(4)]
        assert verdict_of(noisy, scene, filter_name=name) in ("pass", "limitation", "inconclusive"), name
    assert verdict_of([pixels * np.nan], scene) == "bug"


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.sweep_except("size0", "size2", "size3", "size4", "size5")
def test_few_pixels_without_an_edge_hold_any_bug(size: tuple[int, int], desk: Any, words_only: None) -> None:
    scene = read_scene(str(desk.stage(*size, aperture=2.0)))
    envelope = predict(scene)
    for name in ("box", "point", "tent", "unknown"):
        right = np.asarray(envelope.point if name == "point" else envelope.mean, np.float32)
        assert right.min() > 0.0, "the ball fills the picture"
        assert verdict_of([right], scene, filter_name=name) == "pass", name
        for wrong in (right * 3.0 + 0.5, right * 0.0, right[..., ::-1]):
            assert verdict_of([np.ascontiguousarray(wrong)], scene, filter_name=name) == "bug", name


@pytest.mark.parametrize("size", [(1, 1), (64, 1), (1, 3)])
def test_every_command_takes_few_pixels(size: tuple[int, int], desk: Any) -> None:
    desk.source = desk.stage(*size, aperture=2.0)
    right = np.asarray(predict(read_scene(str(desk.source))).mean, np.float32)
    out = desk.folder / "out"
    assert desk.judge(desk.write("small.exr", right), "--out", str(out)) == 0
    assert desk.judge(desk.write("wrong.exr", right * 2.0), "--out", str(out)) == 1
    assert (out / "report.html").is_file()
    assert desk.say("why", str(desk.folder / "wrong.exr"), "--scene", str(desk.source), "--pixel", "0,0") == 0


def test_a_picture_is_decoded_once(desk: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    path = desk.folder / "plain.exr"
    write_exr(path, desk.right)
    seen: list[Path] = []

    def counted(of: Path, **options: Any) -> Picture:
        seen.append(of)
        return read_picture(of, **options)

    monkeypatch.setattr("notabug.commands.judge.read_picture", counted)
    monkeypatch.setattr("notabug.runs.judge_files.read_picture", counted)
    assert desk.judge(path) == 0
    assert seen == [path]


def test_coded_files_are_written_whole(tmp_path: Path) -> None:
    with pytest.raises(Exception, match="cannot write"):
        write_coded(tmp_path / "gone" / "a.jpg", np.zeros((2, 2, 3), np.float32), "uint8", {})
