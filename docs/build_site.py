"""``python docs/build_site.py [OUT]``: these pages, README and CONTRIBUTING as a site, with pages made of the code.

``make docs`` calls it. The site is Material for MkDocs, strict: a link to a page, a file or a heading that is not there
is an error. It asks nothing of the network and opens from disk; the search needs a web server, such as
``python -m http.server --directory build/site``.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import site_reference
import yaml

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
NAVIGATION: list[object] = [
    {"Start": ["index.md", "use.md", "words.md", "glossary.md"]},
    {"Judge your pictures": ["your-pictures.md", "own-scenes.md"]},
    {"Judge your renderer": "your-renderer.md"},
    {"In CI": "ci.md"},
    {
        "How it decides": [
            "judge.md",
            "judge-numbers.md",
            "judge-sensitivity.md",
            "bench.md",
            "design.md",
            "reliability.md",
            "decisions/README.md",
            "not-yet.md",
        ]
    },
    {"The classes": ["classes.md", "figures.md", "workarounds.md", "limitations.md", "preview.md", "gallery.md"]},
    {"The renderers": ["renderers/README.md", "defects/README.md"]},
    {
        "Reference": [
            {"Commands": "reference/commands.md"},
            {"Configuration": "reference/configuration.md"},
            {"File formats": "reference/files.md"},
            {"Python": [f"reference/python-{floor}.md" for floor in site_reference.FLOORS]},
        ]
    },
    {"Troubleshooting": "reference/messages.md"},
    {"Contributing": "contributing.md"},
]


def pages() -> dict[str, str]:
    """The pages that are made of the code, by their path on the site."""
    made = {
        "classes.md": site_reference.classes(),
        "reference/commands.md": site_reference.commands(),
        "reference/configuration.md": site_reference.configuration(),
        "reference/files.md": site_reference.files(),
        "reference/messages.md": site_reference.messages(),
    }
    return made | {f"reference/python-{floor}.md": site_reference.python(floor) for floor in site_reference.FLOORS}


def gather(into: Path) -> None:
    """Write the site's sources: docs, README as the first page, CONTRIBUTING, and what is made of the code."""
    skip = shutil.ignore_patterns("*.py", "__pycache__", "ci")
    shutil.copytree(DOCS, into, ignore=skip)
    (into / "ci").mkdir()
    for path in (DOCS / "ci").iterdir():  # a browser shows them as text
        shutil.copy(path, into / "ci" / (path.name if path.suffix == ".yml" else f"{path.name}.txt"))
    for name, title in (("README.md", "index.md"), ("CONTRIBUTING.md", "contributing.md")):
        (into / title).write_text((ROOT / name).read_text("utf-8").replace("](docs/", "]("), "utf-8")
    for path in into.rglob("*.md"):
        path.write_text(_linked(path.read_text("utf-8"), path.relative_to(into)), "utf-8")
    for name, text in pages().items():
        (into / name).parent.mkdir(exist_ok=True)
        (into / name).write_text(text, "utf-8")


def _linked(text: str, page: Path) -> str:
    """Links as the site has them: CONTRIBUTING and README are pages of it, a folder is its README."""
    up = "../" * (len(page.parts) - 1)
    text = re.sub(r"\]\((?:\.\./)*CONTRIBUTING\.md", f"]({up}contributing.md", text)
    text = re.sub(r"\]\((?:\.\./)*README\.md(?=[)#])", f"]({up}index.md", text) if len(page.parts) == 1 else text
    text = text.replace("](ci/Dockerfile)", "](ci/Dockerfile.txt)")

    def folder(found: re.Match[str]) -> str:
        place = (DOCS / page.parent / found[1]).resolve()
        return f"]({found[1]}/README.md)" if place.is_dir() else found[0]

    return re.sub(r"\]\(([\w./-]+?)/?\)", folder, text)


def configuration(sources: Path, out: Path) -> dict[str, object]:
    """What mkdocs.yml says."""
    return {
        "site_name": "notabug",
        "site_description": "Is it a rendering bug, or really not?",
        "docs_dir": str(sources),
        "site_dir": str(out),
        "use_directory_urls": False,  # so that it opens from disk
        "nav": NAVIGATION,
        "not_in_nav": "/renderers/*\n/decisions/*\n/defects/*/\n",
        "plugins": ["search"],
        "markdown_extensions": ["admonition", "tables", {"toc": {"permalink": True}}, "pymdownx.superfences"],
        "validation": {"links": {"not_found": "warn", "anchors": "warn", "unrecognized_links": "warn"}},
        "theme": {
            "name": "material",
            "font": False,  # else it asks the network for one
            "features": ["navigation.tabs", "navigation.top", "content.code.copy", "search.highlight"],
            "palette": [
                {"media": "(prefers-color-scheme: light)", "scheme": "default", "toggle": _toggle("dark")},
                {"media": "(prefers-color-scheme: dark)", "scheme": "slate", "toggle": _toggle("light")},
            ],
        },
    }


def _toggle(to: str) -> dict[str, str]:
    return {"icon": "material/theme-light-dark", "name": f"{to} colours"}


def build(out: Path) -> int:
    """Build the site in ``out``; the exit code of MkDocs."""
    work = out.with_name(f"{out.name}-sources")
    for folder in (work, out):
        shutil.rmtree(folder, ignore_errors=True)
    work.mkdir(parents=True)
    gather(work / "docs")
    (work / "mkdocs.yml").write_text(yaml.safe_dump(configuration(work / "docs", out), sort_keys=False), "utf-8")
    words = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--config-file", str(work / "mkdocs.yml")]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}  # an advertisement of its successor
    return subprocess.run(words, env=environment, check=False).returncode


if __name__ == "__main__":
    place = Path(sys.argv[1] if sys.argv[1:] else ROOT / "build" / "site").resolve()
    code = build(place)
    print(place / "index.html" if code == 0 else "the site has faults, told above")
    sys.exit(code)
