"""Workarounds of Phong versus Phong."""

from __future__ import annotations

from dataclasses import replace

from notabug.references.models.model import edit_materials
from notabug.references.models.phong import matched
from notabug.references.workarounds.workaround import Setting, Workaround
from notabug.scenes_usd.scene import Scene

_PAPER = "Woo, Pearce and Ouellette 1996, Phong versus Phong"


def _blinn(scene: Scene) -> Scene:
    return edit_materials(scene, lambda each: replace(each, lobe="blinn"))


def _matched(scene: Scene) -> Scene:
    return edit_materials(scene, lambda each: matched(each, "blinn"))


WORKAROUNDS = (
    Workaround(
        name="matched_exponent",
        artifact_class="phong",
        claim="a renderer that has only Blinn's lobe takes four times the exponent meant for Phong's",
        cites=f"{_PAPER}; Fisher and Woo 1994, R.E versus N.H specular highlights, Graphics Gems IV",
        reduces=("lobe_blinn", "lobe_blinn_matched"),
        before=Setting("phong/lobes", {}, "Blinn's lobe, same n", _blinn, {"lobe": "blinn"}),
        after=Setting("phong/lobes", {}, "Blinn's lobe, 4 n", _matched, {"lobe": "blinn_matched"}),
        caveat="Phong's lobe is round about R, Blinn's is drawn out at grazing angles: no exponent makes them one",
        limits=(Setting("phong/floor_lobes", {}, "Blinn's lobe, 4 n", _matched, {"lobe": "blinn_matched"}),),
    ),
)
