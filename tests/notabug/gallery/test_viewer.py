"""The viewer in a browser: exact values, every mode, every key; nothing leaves the page and nothing complains."""

from __future__ import annotations

import base64
from typing import Any

import flip_evaluator
import numpy as np
import numpy.typing as npt
import pytest

from notabug.references import store

SCENE, VARIANT = "texture/uneven_quad", "split=quad"
MODES = ["side", "wipe", "blink", "difference"]
MEASURES = ["absolute", "signed", "relative", "flip", "z", "limitation", "bug", "support"]


WINDOW = {"width": 960, "height": 620}  # pixels: each is shaded by the processor here
TALL = {"width": 1280, "height": 1900}


@pytest.fixture
def quiet(tab: Any, site: Any) -> Any:
    """The tab, of a small window; afterwards it has not complained, and asked for nothing but the site's own files."""
    tab.page.set_viewport_size(WINDOW)
    yield tab
    assert not tab.complaints
    outside = [each for each in tab.requests if not each.startswith((site.base, "about:", "data:", "blob:"))]
    assert not outside
    assert len(tab.requests) > 3


ENCODED = """(values) => { const p = new Uint8Array(values.buffer); let text = "";
for (let i = 0; i < p.length; i += 32768) text += String.fromCharCode(...p.subarray(i, i + 32768));
return btoa(text); }"""


def shown(page: Any) -> npt.NDArray[np.uint8]:
    """The canvas's pixels (h, w, 3), row 0 at the top."""
    width, height, text = page.evaluate(
        f"""() => {{ const c = document.getElementById("picture"), gl = c.getContext("webgl2");
        const p = new Uint8Array(4 * c.width * c.height);
        gl.readPixels(0, 0, c.width, c.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
        return [c.width, c.height, ({ENCODED})(p)]; }}"""
    )
    return np.frombuffer(base64.b64decode(text), np.uint8).reshape(height, width, 4)[::-1, :, :3]


# Pictures come as scripts, from a file and from a server alike, and test_what_is_uploaded_is_every_half_float looks at
# each value from both: what is made of the values then is looked at once.
FROM_A_FILE = pytest.mark.parametrize("site", ["file"], indirect=True)


def values(page: Any, row: str) -> list[float]:
    cells = page.locator("#values tr", has=page.get_by_role("rowheader", name=row, exact=True)).locator("td")
    return [float(each) for each in cells.all_text_contents()]


@FROM_A_FILE
def test_a_pixels_value_is_the_files_to_the_last_bit(quiet: Any, site: Any, halves: Any) -> None:
    reference = store.read(SCENE, VARIANT).pixels
    for x, y in ((0, 0), (255, 255), (1, 0), (17, 130), (200, 3), (128, 251)):
        page = quiet.go_on(site, f"a=reference&b=grey&at={x},{y}")
        page.wait_for_selector(f'#at:text-is("{x}, {y}")')
        assert np.array_equal(np.float16(values(page, "B")), np.float16(halves[y, x]))
        assert values(page, "B") == [float(each) for each in halves[y, x]]
        assert values(page, "A") == [float(each) for each in reference[y, x]]


def test_what_is_uploaded_is_every_half_float(quiet: Any, site: Any, halves: Any) -> None:
    """Not only the six above: the whole picture, read back from the decoder, bit by bit."""
    page = quiet.view(site, "b=grey")
    back = base64.b64decode(page.evaluate(f"() => ({ENCODED})(notabug.shown().b.data)"))
    assert np.array_equal(np.frombuffer(back, np.float32).reshape(*halves.shape[:2], 4)[:, :, :3], halves)


def srgb(linear: Any) -> npt.NDArray[np.float64]:
    """IEC 61966-2-1."""
    v = np.clip(np.asarray(linear, np.float64), 0.0, 1.0)
    return 255.0 * np.where(v <= 0.0031308, 12.92 * v, 1.055 * v ** (1 / 2.4) - 0.055)


def at(picture: npt.NDArray[np.uint8], x: int, y: int, pane: int = 0, panes: int = 1) -> npt.NDArray[np.float64]:
    """The canvas where the fitted 256 x 256 picture's pixel (x, y) is drawn."""
    height, width = picture.shape[0], picture.shape[1] / panes
    zoom = min(width, height) / 256
    left, top = (width - 256 * zoom) / 2, (height - 256 * zoom) / 2
    found = picture[int(top + (y + 0.5) * zoom), int(pane * width + left + (x + 0.5) * zoom)]
    return np.asarray(found, np.float64)


def middle(picture: npt.NDArray[np.uint8]) -> npt.NDArray[np.uint8]:
    """The canvas where one fitted picture is drawn, without its border."""
    height, width = picture.shape[:2]
    reach = min(height, width) // 2 - 20
    return picture[height // 2 - reach : height // 2 + reach, width // 2 - reach : width // 2 + reach]


@FROM_A_FILE
def test_side_by_side_wipe_and_blink_show_both_pictures(quiet: Any, site: Any, halves: Any) -> None:
    page = quiet.view(site, "a=reference&b=grey&mode=side")
    pictures = [shown(page)]
    for key in ("w", "Space", "Space"):
        page.keyboard.press(key)
        pictures.append(shown(page))
    side, wiped, second, first = pictures
    for x, y in ((60, 100), (128, 128), (200, 180)):
        reference, other = store.read(SCENE, VARIANT).pixels[y, x], halves[y, x]
        assert at(side, x, y, 0, 2) == pytest.approx(srgb(reference), abs=1)
        assert at(side, x, y, 1, 2) == pytest.approx(srgb(other), abs=1)
        assert at(wiped, x, y) == pytest.approx(srgb(reference if x < 128 else other), abs=1)
        assert at(second, x, y) == pytest.approx(srgb(other), abs=1)
        assert at(first, x, y) == pytest.approx(srgb(reference), abs=1)


@FROM_A_FILE
def test_exposure_tone_and_channels(quiet: Any, site: Any) -> None:
    x, y = 128, 128
    value = store.read(SCENE, VARIANT).pixels[y, x]
    page = quiet.view(site, "a=reference&b=grey&mode=blink")
    for _ in range(4):
        page.keyboard.press("[")
    assert at(shown(page), x, y) == pytest.approx(srgb(value / 4), abs=1)
    page.keyboard.press("g")
    assert at(shown(page), x, y) == pytest.approx(srgb([value[1] / 4] * 3), abs=1)
    page.keyboard.press("l")
    luminance = float(value @ [0.2126, 0.7152, 0.0722])
    assert at(shown(page), x, y) == pytest.approx(srgb([luminance / 4] * 3), abs=1)
    page.keyboard.press("a")
    assert at(shown(page), x, y) == pytest.approx([255] * 3, abs=1)
    page.keyboard.press("c")
    page.select_option("#tone", "linear")
    assert at(shown(page), x, y) == pytest.approx(255 * value / 4, abs=1)


@FROM_A_FILE
def test_every_difference_of_a_picture_and_itself_is_black_and_of_others_is_not(quiet: Any, site: Any) -> None:
    for measure in MEASURES:
        other = "grey" if measure in ("z", "limitation", "bug") else "model:quad_split_02"
        dimmed = "&ev=-10" if measure == "z" else ""  # it differs by many thousands of tolerances
        page = quiet.go_on(site, f"a=reference&b={other}&mode=difference&of={measure}{dimmed}")
        differing = middle(shown(page))
        if measure == "bug":  # the leg of this result is empty
            assert (page.locator("#measured").text_content() or "").endswith("is empty")
            assert differing.max() < 8
            continue
        assert np.ptp(differing.reshape(-1, 3).astype(int), axis=0).max() > 40, measure
        if measure in ("absolute", "relative", "flip"):
            page = quiet.go_on(site, f"a=reference&b=reference&mode=difference&of={measure}")
            assert middle(shown(page)).max() < 8, measure


@FROM_A_FILE
def test_absolute_difference_is_the_difference(quiet: Any, site: Any, halves: Any) -> None:
    page = quiet.view(site, "a=reference&b=model:quad_split_02&mode=difference&of=absolute&at=128,128")
    assert values(page, "B − A") == pytest.approx(np.subtract(values(page, "B"), values(page, "A")), rel=1e-5, abs=1e-7)
    assert at(shown(page), 128, 128) == pytest.approx(srgb(np.abs(values(page, "B − A"))), abs=1)


@FROM_A_FILE
def test_flip_is_the_judges(quiet: Any, site: Any) -> None:
    """Against NVIDIA's own evaluator."""
    rng = np.random.default_rng(1)
    smooth = np.add.outer(np.linspace(0, 0.5, 24), np.linspace(0, 0.5, 40))[..., None] * [1.0, 0.7, 0.4]
    first = np.clip(smooth + 0.2 * rng.random((24, 40, 3)), 0, 1).astype(np.float32)
    second = first.copy()
    second[8:16, 10:20] *= 0.4
    wanted, _, _ = flip_evaluator.evaluate(first, second, "LDR", False, False, False, {"ppd": 67.0})
    page = quiet.view(site)
    flat = [np.dstack([each, np.ones((24, 40, 1))]).ravel().tolist() for each in (first, second)]
    made = page.evaluate(
        "([p, q]) => Array.from(flip({width: 40, height: 24, data: p}, {width: 40, height: 24, data: q}))", flat
    )
    assert np.array(made).reshape(24, 40) == pytest.approx(np.squeeze(wanted), abs=2e-3)
    assert max(made) > 0.2


@FROM_A_FILE
def test_findings_models_and_terms_are_told(quiet: Any, site: Any) -> None:
    page = quiet.view(site, "a=reference&b=grey")
    assert page.locator(".findings li").count() == 2
    before = shown(page)
    page.keyboard.press("j")
    assert page.locator(".findings li").nth(0).get_attribute("data-current") is not None
    page.keyboard.press("j")
    assert page.locator(".findings li").nth(1).get_attribute("data-current") is not None
    page.keyboard.press("k")
    assert page.locator(".findings li").nth(0).get_attribute("data-current") is not None
    assert not np.array_equal(before, shown(page))
    page.keyboard.press("f")
    assert np.array_equal(before, shown(page))
    page.focus("#picture")
    page.keyboard.press("ArrowRight")
    page.wait_for_selector("#terms dt")
    assert "N′·V" in page.locator("#terms").text_content()
    page.wait_for_selector("#models tr")
    rows = page.locator("#models th").all_text_contents()
    assert rows[0] == "reference"
    assert any("quad split 02" in each for each in rows)


@FROM_A_FILE
def test_the_address_brings_back_what_was_seen(quiet: Any, site: Any) -> None:
    page = quiet.view(site, "a=grey&b=model:quad_split_13&mode=difference&of=signed&ev=2&ch=R&at=33,44")
    for _ in range(2):
        page.keyboard.press("+")
    there, address = shown(page), page.evaluate("location.href")
    again = quiet.open(address)
    again.wait_for_selector("#status", state="hidden")
    assert np.array_equal(shown(again), there)
    assert again.locator("#at").text_content() == "33, 44"
    assert again.input_value("#a") == "grey"
    assert again.input_value("#channels") == "R"


@FROM_A_FILE
def test_zoom_pan_and_touch(quiet: Any, site: Any) -> None:
    page = quiet.view(site, "mode=blink")
    box = page.locator("#picture").bounding_box()
    middle = (box["x"] + box["width"] / 2 + 5, box["y"] + box["height"] / 2 + 5)  # off the border of pixels
    page.mouse.move(*middle)
    page.wait_for_selector('#at:text-matches("[0-9]")')
    first = page.locator("#at").text_content()
    page.mouse.wheel(0, -400)
    page.mouse.move(middle[0] + 1, middle[1])
    assert page.locator("#at").text_content() == first  # the point under the pointer stays
    page.mouse.down()
    page.mouse.move(middle[0] + 120, middle[1] + 40)
    page.mouse.up()
    page.mouse.move(*middle)
    assert page.locator("#at").text_content() != first
    page.mouse.click(*middle)
    page.wait_for_selector("#models tr")
    pinch = """([x, y]) => { const c = document.getElementById("picture");
      const told = (id, dx) => ({pointerId: id, clientX: x + dx, clientY: y, bubbles: true});
      const send = (type, id, dx) => c.dispatchEvent(new PointerEvent(type, told(id, dx)));
      c.setPointerCapture = () => {};
      send("pointerdown", 5, -20); send("pointerdown", 6, 20); send("pointermove", 6, 60);
      send("pointerup", 5, -20); send("pointerup", 6, 60); }"""
    before = shown(page)
    page.evaluate(pinch, list(middle))
    assert not np.array_equal(before, shown(page))


@FROM_A_FILE
def test_help_is_a_dialog_that_closes(quiet: Any, site: Any) -> None:
    page = quiet.view(site)
    page.keyboard.press("?")
    assert page.locator("#keys").is_visible()
    page.keyboard.press("Escape")
    assert not page.locator("#keys").is_visible()


@FROM_A_FILE
def test_a_tall_window_has_one_picture_above_the_other(quiet: Any, site: Any, halves: Any) -> None:
    """Pictures, pixels under the pointer and labels go with it, and a wide window has them side by side again."""
    page = quiet.page
    page.set_viewport_size(TALL)
    quiet.view(site, "a=reference&b=grey&mode=side")
    above, x, y = shown(page), 60, 100
    height, width = above.shape[:2]
    assert height > 1.5 * width
    assert page.evaluate("document.querySelector('.stage').clientHeight / innerHeight") > 0.75
    zoom = min(width / 256, height / 2 / 256)

    def seen(part: int) -> npt.NDArray[np.uint8]:
        down = int(height / 4 + part * height / 2 + (y + 0.5 - 128) * zoom)
        return above[down, int(width / 2 + (x + 0.5 - 128) * zoom)]

    reference = store.read(SCENE, VARIANT).pixels[y, x]
    assert seen(0) == pytest.approx(srgb(reference), abs=1)
    assert seen(1) == pytest.approx(srgb(halves[y, x]), abs=1)
    box = page.locator("#picture").bounding_box()
    for part in (0, 1):
        down = box["height"] * (1 + 2 * part) / 4 + (y + 0.5 - 128) * zoom * box["height"] / height
        page.mouse.click(box["x"] + box["width"] / 2 + (x + 0.5 - 128) * zoom * box["width"] / width, box["y"] + down)
        assert page.locator("#at").text_content() == f"{x}, {y}"
        page.keyboard.press("Escape")
        page.mouse.click(box["x"] + box["width"] / 2 + (x + 0.5 - 128) * zoom * box["width"] / width, box["y"] + down)
    middle = box["y"] + box["height"] / 2
    assert page.locator("#tag-a").bounding_box()["y"] < middle < page.locator("#tag-b").bounding_box()["y"]
    page.set_viewport_size(WINDOW)
    page.wait_for_selector(".stage:not(.stacked)")
