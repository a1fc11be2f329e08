"""An example of every command, as its ``--help`` ends with it."""

from __future__ import annotations

EXAMPLES = {
    "run": "notabug run terminator -r povray --variant tessellation=all",
    "judge": "notabug judge frame.exr --scene terminator/sphere --filter box --precision float32",
    "why": "notabug why frame.exr --scene terminator/sphere --pixel 140,88",
    "references": "notabug references verify terminator/sphere",
    "calibrate": "notabug calibrate -r povray",
    "check": "notabug check shot.usd",
    "adapt": "notabug adapt shot.usd --out own.usda",
    "install": "notabug install panda3d",
    "export": "notabug export terminator/sphere --to gltf",
    "list": "notabug list models",
    "doctor": "notabug doctor",
    "bench": "notabug bench verdict --quick",
    "reduce": "notabug reduce my_scene.usda -r mitsuba",
    "accept": 'notabug accept texture/uneven_quad -r povray --because "two triangles for now"',
    "merge": "notabug merge part1 part2 --out whole",
    "diff": "notabug diff before after",
    "report": "notabug report after --baseline before",
    "gallery": "notabug gallery notabug-out --out site",
}


def epilog(command: str) -> str:
    """The last line of the help of ``command``."""
    return f"Example: {EXAMPLES[command]}"
