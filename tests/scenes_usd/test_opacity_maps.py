"""Maps of opacity and textures with alpha: what is read of them, what is written again, and what is refused."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.own import take_scene
from notabug.scenes_usd.picture import read_picture, write_coded
from notabug.scenes_usd.reader_stage import read_stage
from notabug.scenes_usd.scene import Material, Preview, Scene
from notabug.scenes_usd.srgb import decode_srgb
from notabug.scenes_usd.writer import write_scene

Write = Callable[..., Path]
TEXELS = np.arange(10, 250, 15, dtype=np.uint8).reshape(2, 2, 4)
FRACTIONS = TEXELS / 255
LOOK = "/Scene/Picture/Surface"
DIFFUSE = "color3f inputs:diffuseColor.connect = </Scene/Picture/Texture.outputs:rgb>"


def clear(channel: str, *lines: str) -> tuple[str, str]:
    """The change after which the opacity is the texture's ``channel``; further ``lines`` of the surface."""
    connected = f"float inputs:opacity.connect = </Scene/Picture/Texture.outputs:{channel}>"
    return DIFFUSE, "\n".join((DIFFUSE, connected, *lines))


def textured(*lines: str) -> tuple[str, str]:
    return "# texture", "\n".join((*lines, *(f"float outputs:{channel}" for channel in "rgba")))


@pytest.fixture
def leaf(tmp_path: Path, write: Write, png: Callable[..., bytes]) -> Write:
    """``write`` with a picture of four channels in the place of its own."""
    (tmp_path / "picture.png").write_bytes(png(TEXELS.tobytes(), 2, 2, kind=6))
    return write


def read(path: Path) -> Scene:
    return read_stage(path, "own", {})


def opacity_of(scene: Scene) -> tuple[Material, np.ndarray]:
    (material,) = (each for each in scene.materials if each.opacity_map >= 0)
    return material, scene.textures[material.opacity_map].pixels


@pytest.mark.parametrize("space", ["raw", "sRGB", "auto"])
@pytest.mark.parametrize("channel", "rgba")
def test_each_channel_is_read_and_alpha_is_never_decoded(channel: str, space: str, leaf: Write) -> None:
    path = leaf(clear(channel), textured(), ('sourceColorSpace = "raw"', f'sourceColorSpace = "{space}"'))
    scene = read(path)
    material, pixels = opacity_of(scene)
    stored = FRACTIONS[..., "rgba".index(channel)]
    meant = stored if space == "raw" or channel == "a" else decode_srgb(stored)
    assert pixels == pytest.approx(np.repeat(meant[..., None], 3, axis=2), abs=1e-15)
    assert (material.opacity, material.cutoff, material.preview) == (1.0, 0.0, None)
    assert material.is_clear
    assert material.sends_on


@pytest.mark.parametrize("space", ["raw", "sRGB"])
def test_colours_are_straight(space: str, leaf: Write) -> None:
    """What is stored is the colour, also where alpha is small; nothing is multiplied, and nobody need look at alpha."""
    meant = FRACTIONS[..., :3] if space == "raw" else decode_srgb(FRACTIONS[..., :3])
    for changes in ((), (clear("a"), textured())):
        scene = read(leaf(*changes, ('sourceColorSpace = "raw"', f'sourceColorSpace = "{space}"')))
        (index,) = (each.texture for each in scene.materials if each.texture >= 0)
        np.testing.assert_allclose(scene.textures[index].pixels, meant, atol=1e-15)
        assert scene.textures[index].colour_space == space


def test_scale_and_bias_of_alpha_are_its_own(leaf: Write) -> None:
    lines = "float4 inputs:scale = (1, 1, 1, 0.5)", "float4 inputs:bias = (0, 0, 0, 0.25)"
    scene = read(leaf(clear("a"), textured(*lines)))
    _, pixels = opacity_of(scene)
    np.testing.assert_allclose(pixels[..., 0], 0.5 * FRACTIONS[..., 3] + 0.25)
    (index,) = (each.texture for each in scene.materials if each.texture >= 0)
    np.testing.assert_allclose(scene.textures[index].pixels, FRACTIONS[..., :3])


def test_a_bias_of_alpha_lifts_what_is_beyond_a_black_border(leaf: Write) -> None:
    """The row of texels more that says so moves the coordinates of all maps of the material alike."""
    black = ('wrapS = "clamp"', 'wrapS = "black"')
    scene = read(leaf(clear("a"), textured("float4 inputs:bias = (0, 0, 0, 0.02)"), black))
    _, pixels = opacity_of(scene)
    assert pixels.shape == (2, 4, 3)
    np.testing.assert_allclose(pixels[:, [0, -1], 0], 0.02)
    (index,) = (each.texture for each in scene.materials if each.texture >= 0)
    assert not scene.textures[index].pixels[:, [0, -1]].any()


def test_without_alpha_it_is_one(write: Write) -> None:
    _, pixels = opacity_of(read(write(clear("a"), textured())))
    assert (pixels == 1.0).all()


def test_a_fallback_has_an_alpha(write: Write) -> None:
    gone = ("@./picture.png@", "@./gone.png@")
    _, pixels = opacity_of(read(write(clear("a"), textured("float4 inputs:fallback = (0.1, 0.2, 0.3, 0.4)"), gone)))
    assert pixels.ravel() == pytest.approx([0.4] * 3)


def test_colours_of_associated_files_are_as_stored(write: Write, tmp_path: Path) -> None:
    """An EXR says that its colours are multiplied by alpha; OpenUSD's own readers take them as they are."""
    stored = FRACTIONS.astype(np.float32)
    write_coded(tmp_path / "picture.exr", stored, "float", {})
    scene = read(write(clear("a"), textured(), ("picture.png", "picture.exr")))
    material, pixels = opacity_of(scene)
    np.testing.assert_array_equal(pixels[..., 0], stored[..., 3])
    np.testing.assert_array_equal(scene.textures[material.texture].pixels, stored[..., :3])


def test_pictures_that_are_judged_are_still_shown_over_black(tmp_path: Path) -> None:
    write_coded(tmp_path / "picture.png", TEXELS, "uint8", {"oiio:UnassociatedAlpha": 1})
    shown, stored = read_picture(tmp_path / "picture.png"), read_picture(tmp_path / "picture.png", with_alpha=True)
    assert shown.alpha is None
    np.testing.assert_allclose(shown.pixels, FRACTIONS[..., :3] * FRACTIONS[..., 3:], atol=1e-6)
    np.testing.assert_allclose(stored.pixels, FRACTIONS[..., :3], atol=1e-6)
    assert stored.alpha is not None
    np.testing.assert_allclose(stored.alpha, FRACTIONS[..., 3], atol=1e-6)


@pytest.mark.parametrize(("threshold", "cutoff"), [("0", 0.0), ("-1", 0.0), ("0.5", 0.5), ("2", 2.0)])
def test_the_threshold_is_kept(threshold: str, cutoff: float, leaf: Write) -> None:
    material, _ = opacity_of(read(leaf(clear("a", f"float inputs:opacityThreshold = {threshold}"), textured())))
    assert material.cutoff == cutoff
    assert 0.0 <= material.least_opacity <= cutoff


def test_a_texel_is_as_much_as_the_same_number_in_float32(leaf: Write) -> None:
    material, pixels = opacity_of(read(leaf(clear("a", "float inputs:opacityThreshold = 0.45490196"), textured())))
    same = pixels[0, 1, 0] == 116 / 255 or pixels[..., 0].ravel()
    assert float(np.float32(0.45490196)) > 116 / 255, "float32 is the larger one"
    assert 115.99 / 255 < material.least_opacity <= 116 / 255, same


def test_a_glossy_surface_may_be_cut_but_not_fade(leaf: Write) -> None:
    """A map without a threshold fades highlights or not, as opacityMode says; with one all of the surface goes."""
    text = 'def Material "Picture"'

    def glossy(*lines: str) -> Path:
        path = leaf(clear("a", *lines), textured())
        head, _, rest = path.read_text().partition(text)
        path.write_text(head + text + rest.replace("useSpecularWorkflow = 1", "useSpecularWorkflow = 0", 1))
        return path

    with pytest.raises(SceneError, match="presence") as caught:
        read(glossy())
    assert caught.value.where == f"{LOOK}.inputs:opacity"
    assert "a map without opacityThreshold" in caught.value.got
    for line in ('token inputs:opacityMode = "presence"', "float inputs:opacityThreshold = 0.3"):
        material, _ = opacity_of(read(glossy(line)))
        assert isinstance(material.preview, Preview)
    (shown,) = (each for each in take_scene(glossy()).scene.materials if each.preview is not None)
    assert (shown.opacity, shown.opacity_map) == (1.0, -1), "notabug adapt makes it opaque"


def test_other_coordinates_than_the_colours_are_refused(leaf: Write) -> None:
    other = (
        'def Shader "Coordinates"',
        'def Shader "Mask"\n{\nuniform token info:id = "UsdUVTexture"\nasset inputs:file = @./picture.png@\n'
        "float2 inputs:st.connect = </Scene/Picture/Other.outputs:result>\nfloat outputs:a\n}\n"
        'def Shader "Other"\n{\nuniform token info:id = "UsdPrimvarReader_float2"\nstring inputs:varname = "uv2"\n'
        'float2 outputs:result\n}\ndef Shader "Coordinates"',
    )
    change = (DIFFUSE, f"{DIFFUSE}\nfloat inputs:opacity.connect = </Scene/Picture/Mask.outputs:a>")
    path = leaf(change, other)
    with pytest.raises(SceneError, match=r"inputs:opacity: looked up elsewhere than the material's other maps"):
        read(path)
    (material,) = take_scene(path).scene.materials
    assert (material.opacity, material.opacity_map) == (1.0, -1)


def test_on_a_sphere_it_is_refused(leaf: Write) -> None:
    ball = 'def Sphere "Ball"\n{\n    rel material:binding = </Scene/Picture>\n}\n'
    path = leaf(clear("a"), textured(), ("# scene", ball))
    with pytest.raises(SceneError, match="a sphere has no texture coordinates"):
        read(path)


def test_a_connected_threshold_is_refused(leaf: Write) -> None:
    line = "float inputs:opacityThreshold.connect = </Scene/Picture/Texture.outputs:a>"
    with pytest.raises(SceneError, match="may not be textured") as caught:
        read(leaf(clear("a", line), textured()))
    assert caught.value.where == f"{LOOK}.inputs:opacityThreshold"


@pytest.mark.parametrize("line", ["", "float inputs:opacityThreshold = 0.4"])
def test_written_it_reads_back(line: str, leaf: Write, tmp_path: Path) -> None:
    scene = read(leaf(clear("a", line), textured()))
    back = read(write_scene(scene, tmp_path / "again" / "scene.usda"))
    (said, meant), (found, shown) = opacity_of(scene), opacity_of(back)
    assert (found.opacity, found.preview) == (said.opacity, said.preview)
    assert found.cutoff == pytest.approx(said.cutoff)
    np.testing.assert_allclose(shown, meant, atol=1e-7)
    np.testing.assert_array_equal(back.textures[found.texture].pixels, scene.textures[said.texture].pixels)


def test_maps_are_renumbered_and_hashed() -> None:
    material = Material("/Look", (1.0, 1.0, 1.0), 2, opacity_map=4, cutoff=0.5)
    assert material.textures == {2, 4}
    kept = material.renumbered([2, 4])
    assert (kept.texture, kept.opacity_map, kept.cutoff) == (0, 1, 0.5)
    assert material.renumbered([2]).opacity_map == -1


def test_a_map_and_its_cutoff_are_in_the_digest(leaf: Write) -> None:
    plain, mapped, cut = (
        read(leaf(*changes)).digest()
        for changes in (
            (),
            (clear("a"), textured()),
            (clear("a", "float inputs:opacityThreshold = 0.4"), textured()),
        )
    )
    assert len({plain, mapped, cut}) == 3
