"""The card: customData ``notabug`` on the default prim, checked word by word."""

from __future__ import annotations

from collections.abc import Mapping

from notabug.scenes_usd.errors import SceneError
from notabug.scenes_usd.scene import Card

CLASSES = (
    "acne",
    "terminator",
    "phong",
    "separation",
    "mirror",
    "visibility",
    "texture",
    "shadow_map",
    "normal_maps",
    "texture_space",
    "area_shadows",
    "calibration",
)

OWN = "own"  # the class of a scene that is not the corpus's
OWN_CARD = Card(OWN, "the scene looks as its file says")

_STRINGS = ("class", "claim", "figure", "cites", "intent")
_EXAMPLE = (
    'write customData = { dictionary notabug = { string class = "texture"; string claim = "..." } } on the default prim'
)


def read_card(custom: Mapping[str, object], prim: str) -> Card:
    """The card in ``custom``, the customData of the default prim at path ``prim``.

    A scene without one is a team's own. Raises SceneError where a key is unknown or of another type, or class or claim
    is missing.
    """
    where = f"{prim}.customData:notabug"
    if "notabug" not in custom:
        return OWN_CARD
    card = custom["notabug"]
    if not isinstance(card, Mapping):
        raise SceneError("the card is no dictionary", where=where, got=type(card).__name__, do=_EXAMPLE)
    for key, value in card.items():
        if key == "requires":
            continue
        if key not in _STRINGS:
            known = ", ".join(sorted((*_STRINGS, "requires")))
            raise SceneError(f"unknown key {key!r}", where=f"{where}:{key}", expected=f"one of {known}")
        if not isinstance(value, str):
            raise SceneError("not a string", where=f"{where}:{key}", got=repr(value))
    requires = card.get("requires", ())
    if isinstance(requires, str) or not all(isinstance(word, str) for word in requires):
        raise SceneError("not a list of strings", where=f"{where}:requires", got=repr(requires), expected="string[]")
    for key in ("class", "claim"):
        if not card.get(key, "").strip():
            raise SceneError("missing or empty", where=f"{where}:{key}", do=_EXAMPLE)
    if card["class"] not in (*CLASSES, OWN):
        raise SceneError(
            "unknown class",
            where=f"{where}:class",
            expected=f"one of {', '.join((*CLASSES, OWN))}",
            got=repr(card["class"]),
        )
    return Card(
        artifact_class=card["class"],
        claim=card["claim"],
        requires=frozenset(requires),
        figure=card.get("figure", ""),
        cites=card.get("cites", ""),
        intent=card.get("intent", ""),
    )
