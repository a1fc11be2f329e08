"""``python docs/preview.py RUN...``: write preview.md, what each renderer makes of UsdPreviewSurface and UsdLux.

The runs are those of ``notabug run preview``; a renderer of a later one replaces its results of an earlier one.
"""

from __future__ import annotations

import sys
from pathlib import Path

from notabug.results.conformance import RIGHT, Row, markdown, rows
from notabug.results.record import load

HEAD = """# UsdPreviewSurface and UsdLux, feature by feature

OpenUSD says what a preview surface and a light look like. Whether a renderer reads them so is asked here by {count}
small scenes, one for each feature:

```sh
notabug run preview
notabug run preview/roughness_33 preview/roughness_33_map -r inhouse
```

Each is a layer of a few lines over one base, a curved tile before a wall, under a point and a distant light; they are
in [scenes_usd/preview](../scenes_usd/preview). **right**: the picture is what is specified. **convention**: it differs
by a choice that the specification leaves open, such as the masking of GGX. **limitation** and **bug** are as
everywhere, and **unsupported** means that the renderer, or its adapter, says that it lacks the feature. Only direct
light is asked for. `notabug gallery` of such a run has a page with the pictures.

A full run draws the rest of the corpus; these scenes are drawn where the word `preview` asks for them.

Known disagreements between renderers are among them: a roughness in a texture against the same one as a constant
(usd-wg/assets 98), the specular workflow read the wrong way round (arnold-usd 1183).

{right}. `python docs/preview.py RUN` wrote this page from a run.

"""


def page(found: list[Row]) -> str:
    """The page as Markdown."""
    names = list(dict.fromkeys(name for row in found for name in row.cells))
    right = (f"{name} {sum(row.cells.get(name, ('', ''))[1] == RIGHT for row in found)}" for name in names)
    told = f"Right of {len(found)}: {', '.join(right)}"
    return HEAD.format(count=len(found), right=told) + "\n".join(markdown(found)) + "\n"


if __name__ == "__main__":
    runs = [load(Path(run))["results"] for run in sys.argv[1:]]
    merged = {(result["scene"], result["renderer"]): result for run in runs for result in run}
    Path(__file__).with_name("preview.md").write_text(page(rows(merged.values())), encoding="utf-8")
