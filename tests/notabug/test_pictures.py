"""Pictures as they come: windows, layers and orientation; the verdict, the message and the exit code."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt
import pytest

from notabug.scenes_usd.picture import read_picture

Pixels = npt.NDArray[np.float32]
WIDTH, HEIGHT = 48, 36  # of the scene on the desk

DEPTH = np.full((HEIGHT, WIDTH, 1), 5.0, np.float32)


class TestWindows:
    """Data and display windows."""

    def test_a_crop_is_the_whole_picture(self, desk: Any) -> None:
        columns = np.flatnonzero(desk.right.any((0, 2)))
        top, left = 0, int(columns[0])
        assert left > 0, "the border is black"
        cut = desk.right[:, left : columns[-1] + 1]
        for name in ("cut.exr", "cut.tif"):
            path = desk.write(name, cut, x=left, y=top, full_width=WIDTH, full_height=HEIGHT)
            assert desk.judge(path) == 0
            assert f"at ({left}, {top}) of the display window, {WIDTH} x {HEIGHT}" in desk.out.replace("\n", " ")

    @pytest.mark.parametrize("border", [1, 10, 40])
    def test_overscan_is_left_out(self, border: int, desk: Any) -> None:
        wide = np.full((HEIGHT + 2 * border, WIDTH + 2 * border, 3), 0.7, np.float32)
        wide[border:-border, border:-border] = desk.right
        at = {"x": -border, "y": -border, "full_width": WIDTH, "full_height": HEIGHT}
        assert desk.judge(desk.write("wide.exr", wide, **at)) == 0

    @pytest.mark.parametrize("by", [(9, 6), (-5, 0), (0, 3)])
    def test_a_moved_window_is_a_shift(self, by: tuple[int, int], desk: Any) -> None:
        at = {"x": by[0], "y": by[1], "full_width": WIDTH, "full_height": HEIGHT}
        assert desk.judge(desk.write("moved.exr", desk.right, **at)) == 1
        assert "shift" in desk.out

    def test_a_display_window_that_begins_elsewhere(self, desk: Any) -> None:
        at = {"x": 7, "y": 5, "full_x": 7, "full_y": 5, "full_width": WIDTH, "full_height": HEIGHT}
        assert desk.judge(desk.write("page.exr", desk.right, **at)) == 0

    def test_the_place_of_a_tiff_on_its_page_is_no_window(self, desk: Any) -> None:
        at = {"x": 7, "y": 5, "full_width": WIDTH, "full_height": HEIGHT}
        assert desk.judge(desk.write("page.tif", desk.right, **at)) == 0

    def test_windows_that_do_not_meet_show_black(self, desk: Any) -> None:
        at = {"x": 500, "y": 500, "full_width": WIDTH, "full_height": HEIGHT}
        assert desk.judge(desk.write("apart.exr", desk.right, **at)) == 1
        assert "black" in desk.out

    def test_another_display_window_is_another_size(self, desk: Any) -> None:
        assert desk.judge(desk.write("larger.exr", desk.right, full_width=WIDTH + 2, full_height=HEIGHT)) == 1
        assert f"the picture is {WIDTH + 2} x {HEIGHT}" in desk.out


class TestLayers:
    """Layers and parts."""

    @pytest.mark.parametrize(
        ("prefix", "names"),
        [
            ("beauty.Combined", "RGB"),
            ("ViewLayer.Combined", "RGBA"),
            ("Ebene 1.Combined", "RGBA"),
            ("rgba", "rgb"),
            ("beauty", ["red", "green", "blue"]),
        ],
    )
    def test_the_layer_that_is_called_a_picture(self, prefix: str, names: Any, desk: Any) -> None:
        other = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
        alpha = [np.ones((HEIGHT, WIDTH, 1), np.float32)] * (len(names) - 3)
        channels = ("DiffCol.R", "DiffCol.G", "DiffCol.B", *(f"{prefix}.{each}" for each in names), "Depth.Z")
        pixels = np.concatenate([other, desk.right, *alpha, DEPTH], axis=2)
        result = desk.result(desk.write("layers.exr", pixels, channelnames=channels))
        assert result["verdict"] == "pass"
        assert result["channels"] == [f"{prefix}.{each}" for each in list(names)[:3]]

    def test_names_and_not_the_order_tell_the_channels(self, desk: Any) -> None:
        for names, of in ((("B", "G", "R"), [2, 1, 0]), (("A", "B", "G", "R"), [0, 2, 1, 0])):
            pixels = desk.right[..., of].copy()
            if len(of) == 4:
                pixels[..., 0] = 1.0
            result = desk.result(desk.write("bgr.exr", pixels, channelnames=names))
            assert (result["verdict"], result["channels"]) == ("pass", ["R", "G", "B"])

    def test_plain_colours_come_before_any_layer(self, desk: Any) -> None:
        pixels = np.concatenate([desk.right * 0.5, desk.right], axis=2)
        names = ("Combined.R", "Combined.G", "Combined.B", "R", "G", "B")
        assert desk.result(desk.write("both.exr", pixels, channelnames=names))["channels"] == ["R", "G", "B"]

    def test_every_part_is_looked_at(self, desk: Any) -> None:
        grey = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
        rgb = ("R", "G", "B")
        for name, parts in (
            ("depth first", {"depth": (("Z",), DEPTH), "rgb": (rgb, desk.right)}),
            ("one of two", {"albedo": (rgb, grey), "ViewLayer.Combined": (rgb, desk.right)}),
            ("with prefixes", {"a": (("N.X", "N.Y", "N.Z"), grey), "b": (("C.R", "C.G", "C.B"), desk.right)}),
        ):
            result = desk.result(desk.parts(f"{name}.exr", parts))
            assert result["verdict"] == "pass", name
            assert any(list(parts)[1] in each for each in result["notes"]), name

    def test_what_leaves_a_choice_is_refused_with_the_layers(self, desk: Any) -> None:
        rgb = ("R", "G", "B")
        grey = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
        two = desk.write(
            "two.exr",
            np.concatenate([grey, desk.right], axis=2),
            channelnames=(*(f"Diffuse.{each}" for each in rgb), *(f"Direct.{each}" for each in rgb)),
        )
        parts = desk.parts("parts.exr", {"left": (rgb, grey), "right": (rgb, desk.right)})
        twice = desk.write(
            "twice.exr",
            np.concatenate([grey, desk.right], axis=2),
            channelnames=(*(f"A.Combined.{each}" for each in rgb), *(f"B.Combined.{each}" for each in rgb)),
        )
        for path, named, layer in (
            (two, "Diffuse (R, G, B)", "Direct"),
            (parts, "left", "right"),
            (twice, "A.", "B.Combined"),
        ):
            assert desk.judge(path) == 2
            assert "several layers may be the picture" in desk.err
            assert named in desk.err
            assert "which? --layer NAME" in desk.err
            assert desk.judge(path, "--layer", layer) == 0
            assert layer in desk.out

    @pytest.mark.parametrize(
        ("names", "listed"),
        [
            (("Z",), "(Z)"),
            (("depth",), "(depth)"),
            (("Depth.Z",), "Depth (Z)"),
            (("A",), "(A)"),
            (("N.X", "N.Y", "N.Z"), "N (X, Y, Z)"),
            (("X", "Y", "Z"), "(X, Y, Z)"),
            (("R", "G"), "(R, G)"),
        ],
    )
    def test_what_is_no_picture_is_refused(self, names: tuple[str, ...], listed: str, desk: Any) -> None:
        path = desk.write("aov.exr", desk.right[..., : len(names)], channelnames=names)
        assert desk.judge(path) == 2
        assert "no channel is a colour" in desk.err
        assert listed in desk.err

    def test_a_layer_that_is_not_there(self, desk: Any) -> None:
        path = desk.write("plain.exr", desk.right)
        assert desk.judge(path, "--layer", "beauty") == 2
        assert "no layer 'beauty' that is a picture" in desk.err

    def test_why_takes_a_layer_and_names_the_channels(self, desk: Any) -> None:
        grey = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
        names = tuple(f"{layer}.{each}" for layer in ("One", "Two") for each in "RGB")
        path = desk.write("two.exr", np.concatenate([grey, desk.right], axis=2), channelnames=names)
        words = ("why", str(path), "--scene", str(desk.source), "--pixel", "20,18")
        assert desk.say(*words) == 2
        desk.capture.readouterr()
        assert desk.say(*words, "--layer", "Two") == 0
        assert "judged: Two.R, Two.G, Two.B" in desk.capture.readouterr().out
        assert desk.say(*words, "--layer", "Two", "--json") == 0
        assert json.loads(desk.capture.readouterr().out)["channels"] == ["Two.R", "Two.G", "Two.B"]

    def test_a_chosen_layer_is_what_the_report_shows(self, desk: Any) -> None:
        grey = np.full((HEIGHT, WIDTH, 3), 0.5, np.float32)
        names = tuple(f"{layer}.{each}" for layer in ("One", "Two") for each in "RGB")
        path = desk.write("two.exr", np.concatenate([grey, desk.right], axis=2), channelnames=names)
        assert desk.judge(path, "--layer", "Two", "--out", str(desk.folder / "out")) == 0
        document = json.loads((desk.folder / "out" / "run.json").read_text())
        result = document["results"][0]
        assert result["channels"] == ["Two.R", "Two.G", "Two.B"]
        np.testing.assert_array_equal(read_picture(desk.folder / "out" / result["image"]).pixels, desk.right)


class TestOrientation:
    """Which row and column of the picture the first row and column of the file are, by TIFF 6.0."""

    STORED: ClassVar[dict[int, Callable[[Pixels], Pixels]]] = {
        1: lambda p: p,
        2: lambda p: p[:, ::-1],
        3: lambda p: p[::-1, ::-1],
        4: lambda p: p[::-1],
        5: lambda p: p.transpose(1, 0, 2),
        6: lambda p: p[:, ::-1].transpose(1, 0, 2),
        7: lambda p: p[::-1, ::-1].transpose(1, 0, 2),
        8: lambda p: p[::-1].transpose(1, 0, 2),
    }

    @pytest.mark.parametrize("tag", range(1, 9))
    def test_every_value_is_applied_and_said(self, tag: int, desk: Any) -> None:
        path = desk.write("tagged.tif", self.STORED[tag](desk.right), attributes={"Orientation": tag})
        assert desk.judge(path) == 0
        assert (f"its Orientation is {tag}" in desk.out) == (tag != 1)

    @pytest.mark.parametrize("tag", [2, 4, 6, 8])
    def test_a_picture_that_is_stored_upright_under_a_tag_is_turned(self, tag: int, desk: Any) -> None:
        path = desk.write("wrong.tif", desk.right, attributes={"Orientation": tag})
        assert desk.judge(path) == 1

    @pytest.mark.parametrize(
        ("line", "tag"),
        [
            ("-Y {1} +X {0}", 1),
            ("-Y {1} -X {0}", 2),
            ("+Y {1} -X {0}", 3),
            ("+Y {1} +X {0}", 4),
            ("+X {0} -Y {1}", 5),
            ("-X {0} -Y {1}", 6),
            ("-X {0} +Y {1}", 7),
            ("+X {0} +Y {1}", 8),
        ],
    )
    def test_the_size_line_of_radiance(self, line: str, tag: int, desk: Any) -> None:
        stored = self.STORED[tag](desk.right)
        path = desk.write("line.hdr", stored)
        plain = f"-Y {stored.shape[0]} +X {stored.shape[1]}\n".encode()
        data = path.read_bytes()
        assert plain in data
        path.write_bytes(data.replace(plain, (line.format(WIDTH, HEIGHT) + "\n").encode()))
        assert desk.judge(path) == 0

    def test_a_pfm_and_a_tga_are_turned_by_their_formats(self, desk: Any) -> None:
        for name, stored in (("up.pfm", "float"), ("up.tga", "uint8")):
            assert desk.judge(desk.write(name, desk.right, stored)) == 0
