"""Which channels of a file are the picture: files hold layers, parts, depth and normals beside it.

The picture is red, green and blue without a layer's name; else of the layer or part that is called as pictures are
(``BEAUTY``, after whatever view layer); else of the only layer that has the three. A file without such a layer may
hold luminance. Whatever is left is no picture, and a guess would judge the wrong thing: it is refused.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import OpenImageIO

BEAUTY = frozenset({"combined", "beauty", "rgba", "rgb"})
_COLOURS = ({"r", "red"}, {"g", "green"}, {"b", "blue"})
_ALPHA = {"a", "alpha"}
_LUMINANCE = {"y", "l", "i", "v", "luminance", "gray", "grey"}
_OTHER_SENSE = {"x", "ry", "by"}  # beside these Y is a coordinate, or the luminance of subsampled colours


@dataclass(frozen=True, slots=True)
class Layer:
    """Channels of one name in one part of a file.

    ``part`` is its index, ``part_name`` its name where the file has several, ``name`` the channels' prefix or "".
    ``channels`` maps what follows the prefix to the channel's index.
    """

    part: int
    part_name: str
    name: str
    channels: dict[str, int]

    @property
    def label(self) -> str:
        """What a user calls it."""
        return ".".join(each for each in (self.part_name, self.name) if each)

    @property
    def colours(self) -> tuple[int, ...]:
        """The indices of red, green and blue, or of luminance alone; () where there are neither."""
        folded = {name.lower(): index for name, index in self.channels.items()}
        three = [next((folded[name] for name in names if name in folded), None) for names in _COLOURS]
        if None not in three:
            return tuple(each for each in three if each is not None)
        if any(each is not None for each in three) or _OTHER_SENSE & folded.keys():
            return ()
        return tuple(folded[name] for name in sorted(_LUMINANCE & folded.keys()))[:1]

    @property
    def alpha(self) -> int | None:
        return next((index for name, index in self.channels.items() if name.lower() in _ALPHA), None)

    @property
    def is_beauty(self) -> bool:
        """Called as pictures are, by its own name or, where it has none, by its part's."""
        return (self.name or self.part_name).rpartition(".")[2].lower() in BEAUTY

    def __str__(self) -> str:
        return f"{self.label or 'without a name'} ({', '.join(self.channels)})"


def layers_of(parts: Sequence[OpenImageIO.ImageSpec]) -> list[Layer]:
    """The layers of a file whose parts have the headers ``parts``, in their order."""
    found: dict[tuple[int, str], dict[str, int]] = {}
    for part, spec in enumerate(parts):
        for index, channel in enumerate(spec.channelnames):
            name, _, last = channel.rpartition(".")
            found.setdefault((part, name), {})[last] = index
    names = [str(spec.getattribute("oiio:subimagename") or f"part{part}") for part, spec in enumerate(parts)]
    return [
        Layer(part, names[part] if len(parts) > 1 else "", name, channels) for (part, name), channels in found.items()
    ]


def choose(layers: Sequence[Layer], wanted: str = "") -> Layer | None:
    """The layer that is the picture, or the one that is ``wanted``; None where there is none or more than one."""
    if wanted:
        named = [layer for layer in layers if wanted in (layer.label, layer.name, layer.part_name)]
        named = named or [layer for layer in layers if wanted.lower() in (layer.label.lower(), layer.name.lower())]
        return _only([each for each in named if len(each.colours) == 3]) or _only(
            [each for each in named if each.colours]
        )
    for candidates in (
        [layer for layer in layers if len(layer.colours) == 3],
        [layer for layer in layers if layer.colours and (not layer.name or layer.is_beauty)],
    ):
        bare = [candidate for candidate in candidates if not candidate.name]
        for some in (
            [each for each in bare if not each.part_name or each.is_beauty],
            [candidate for candidate in candidates if candidate.is_beauty],
            bare,
            candidates,
        ):
            if some:
                return _only(some)
    return None


def _only(some: Sequence[Layer]) -> Layer | None:
    return some[0] if len(some) == 1 else None
