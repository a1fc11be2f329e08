"""The house keeps its floors: packages are listed, imports go down only, links are there, the wheel is complete."""

from __future__ import annotations

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[1]
FLOORS = ("scenes_usd", "references", "adapters", "metrics", "notabug")  # from the ground up
LINKS = FLOORS[:-1]
OURS = (
    "*.py",
    "*.toml",
    "*.md",
    "*.yaml",
    "*.yml",
    "*.txt",
    "*.html",
    "*.css",
    "*.usda",
    "*.h",
    "*.cpp",
    "*.pyi",
    "*.in",
    "Makefile",
    "Dockerfile*",
    "run",
    "renderers",
    "browser",
    "compiler",
    "sanitize",
)


def setuptools() -> Any:
    return tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["setuptools"]


def sources(floor: str) -> Iterator[Path]:
    """The floor's Python files, links not followed."""
    for folder, folders, files in os.walk(ROOT / floor, followlinks=False):
        folders[:] = [each for each in folders if each != "__pycache__" and not (Path(folder) / each).is_symlink()]
        yield from (Path(folder) / each for each in files if each.endswith(".py"))


def floor_of(module: str) -> int | None:
    """The height of the floor that ``module`` lives on; None for other people's modules."""
    parts = module.split(".")
    if parts[0] != "notabug":
        return None
    return FLOORS.index(parts[1]) if len(parts) > 1 and parts[1] in LINKS else len(FLOORS) - 1


def imports(path: Path) -> Iterator[tuple[str, ast.stmt]]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from ((each.name, node) for each in node.names)
        elif isinstance(node, ast.ImportFrom):
            module = node.module or ""
            yield module, node
            yield from ((f"{module}.{each.name}", node) for each in node.names if module == "notabug")


def tracked() -> list[Path]:
    """Every text file of ours: what git knows, or what lies there when this is no checkout."""
    done = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    names = done.stdout.split("\0") if done.returncode == 0 else [str(p.relative_to(ROOT)) for p in ROOT.rglob("*")]
    paths = [ROOT / name for name in names if name and ".venv" not in name]
    return [path for path in paths if path.is_file() and any(fnmatch(path.name, kind) for kind in OURS)]


@pytest.mark.parametrize("floor", FLOORS)
def test_every_package_is_listed(floor: str) -> None:
    """One that is not listed works in a checkout and is missing from the wheel."""
    listed = setuptools()
    for folder in {path.parent for path in sources(floor)}:
        relative = folder.relative_to(ROOT)
        name = ".".join(relative.parts if floor == "notabug" else ("notabug", *relative.parts))
        assert (folder / "__init__.py").is_file(), f"{relative} holds modules and no __init__.py"
        assert name in listed["packages"], f"add {name} to tool.setuptools.packages"
        assert listed["package-dir"].get(name) == relative.as_posix(), f"add {name} to tool.setuptools.package-dir"


def test_every_listed_package_is_there() -> None:
    listed = setuptools()
    assert sorted(listed["packages"]) == sorted(listed["package-dir"])
    assert [
        name for name, folder in listed["package-dir"].items() if not (ROOT / folder / "__init__.py").is_file()
    ] == []


@pytest.mark.parametrize("floor", FLOORS)
def test_no_import_goes_up(floor: str) -> None:
    height = FLOORS.index(floor)
    # A module of notabug's root, like its version, belongs to nobody's floor.
    up = [
        f"{path.relative_to(ROOT)}:{node.lineno} imports {module}"
        for path in sources(floor)
        for module, node in imports(path)
        if (found := floor_of(module)) is not None
        and found > height
        and module not in ("notabug", "notabug.__version__")
    ]
    assert up == []


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_are_absolute_and_by_the_package(floor: str) -> None:
    wrong = [
        f"{path.relative_to(ROOT)}:{node.lineno}"
        for path in sources(floor)
        for module, node in imports(path)
        if (isinstance(node, ast.ImportFrom) and node.level) or module.split(".")[0] in LINKS
    ]
    assert wrong == []


def test_the_floor_test_can_fail() -> None:
    assert floor_of("notabug.scenes_usd.scene") == 0
    assert floor_of("notabug.cli") == floor_of("notabug.report.page") == 4
    assert floor_of("numpy") is None


@pytest.mark.parametrize("floor", LINKS)
def test_the_links_are_there(floor: str) -> None:
    """mypy, pyright and a plain checkout see the same tree as the installed package."""
    link = ROOT / "notabug" / floor
    assert link.is_symlink()
    assert str(link.readlink()) == f"../{floor}"
    assert link.resolve() == ROOT / floor


def test_no_file_names_the_place_it_was_written_at() -> None:
    """Absolute paths of somebody's machine; the places of system libraries are fine, and so are <paths of prims>."""
    place = re.compile(r"(?<![\w./~$}<-])/(?:home|root|Users|work|workspace|mnt|tmp)/[\w.-]+")
    here = re.escape(str(ROOT))
    found = [
        f"{path.relative_to(ROOT)}: {match.group()}"
        for path in tracked()
        for match in re.finditer(f"{place.pattern}|{here}", path.read_text(encoding="utf-8"))
    ]
    assert found == []


def test_the_pins_cover_the_dependencies_and_name_no_host() -> None:
    """Each direct dependency has exactly one exact pin."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    lines = [each for each in (ROOT / "constraints.txt").read_text().splitlines() if each and each[0] != "#"]
    assert all(re.fullmatch(r"[A-Za-z0-9_.-]+==[A-Za-z0-9_.!+-]+", each) for each in lines)
    pinned = [normal(each.partition("==")[0]) for each in lines]
    assert len(pinned) == len(set(pinned))
    asked = [*project["dependencies"], *(each for extra in project["optional-dependencies"].values() for each in extra)]
    assert {normal(re.split(r"[<>=!~\[; ]", each)[0]) for each in asked} - set(pinned) == set()


def normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


STAND_IN = """
import pathlib, shutil, subprocess, sys
words, target = sys.argv[1:], pathlib.Path(sys.argv[sys.argv.index("-o") + 1])
if "-c" in words:
    preprocessed = ["-E" if word == "-c" else word for word in words]
    done = subprocess.run(["c++", *preprocessed], check=False)
    sys.exit(done.returncode)
assert all(pathlib.Path(word).is_file() for word in words if word.endswith(".o")), words
shutil.copyfile({built!r}, target)
"""
"""A compiler that reads every source with all that it includes, and links the extension that is built already."""


@pytest.fixture(scope="module", params=["stand-in", pytest.param("compiler", marks=pytest.mark.sweep)])
def wheel(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the sdist, which is built from a copy: so both are complete.

    `make setup` compiled the same sources by the same setup.py, which takes a minute: the stand-in finds what is lost.
    """
    from notabug.references import _native

    pytest.importorskip("setuptools", minversion="77")
    pytest.importorskip("pybind11")
    if shutil.which("c++") is None:
        pytest.skip("needs c++ to build the extension")
    folder = tmp_path_factory.mktemp("wheel")
    source = _copy(folder / "source")
    for each in (source / "references").glob("_native.*.so"):
        each.unlink()
    environment = {}
    if request.param == "stand-in":
        program = folder / "stand_in.py"
        program.write_text(STAND_IN.format(built=_native.__file__))
        environment["CXX"] = shlex.join([sys.executable, "-I", str(program)])
    _run(source, sys.executable, "setup.py", "--quiet", "sdist", "--dist-dir", str(folder))
    (archive,) = folder.glob("*.tar.gz")
    pip = (sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation")
    _run(folder, *pip, "--disable-pip-version-check", "-w", str(folder), str(archive), **environment)
    (made,) = folder.glob("*.whl")
    return made


def _run(folder: Path, *words: str, **environment: str) -> str:
    variables = {**os.environ, **environment}
    done = subprocess.run(words, cwd=folder, env=variables, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


@pytest.mark.slow
def test_the_wheel_holds_every_module_and_every_data_file(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert len(names) == len(set(names))
    assert {name.split("/")[0] for name in names} == {"notabug", f"notabug-{wheel.name.split('-')[1]}.dist-info"}
    wanted = {_installed(path.relative_to(ROOT)) for floor in FLOORS for path in [*sources(floor), *_data(floor)]}
    assert wanted - set(names) == set()
    assert [each for each in names if re.fullmatch(r"notabug/references/_native\.[\w.-]+\.so", each)]


@pytest.mark.slow
def test_the_installed_wheel_judges_without_a_compiler_and_without_a_home(wheel: Path, tmp_path: Path) -> None:
    """Its dependencies are this environment's; PATH is empty, and the cache's place can hold no folder."""
    site, picture = tmp_path / "site", tmp_path / "picture.exr"
    zipfile.ZipFile(wheel).extractall(site)
    code = f"""
from pathlib import Path
import notabug
assert notabug.__file__.startswith({str(site)!r}), notabug.__file__
from notabug.references.tracer.envelope import trace_envelope
from notabug.scenes_usd.picture import write_exr
from notabug.scenes_usd.reader import read_scene
scene = read_scene("terminator/sphere", {{"tessellation": "8x4"}})
write_exr(Path({str(picture)!r}), trace_envelope(scene.as_intended()).point.astype("float32"))
import sys
sys.argv = ["notabug", "judge", {str(picture)!r}, "--scene", "terminator/sphere", "--variant", "tessellation=8x4"]
from notabug.__main__ import main
main()
"""
    nowhere = str(tmp_path / "picture.exr" / "below a file")
    environment = {"PYTHONPATH": str(site), "PATH": "", "HOME": nowhere, "XDG_CACHE_HOME": nowhere, "NOTABUG_CACHE": ""}
    assert "pass  terminator/sphere" in _run(tmp_path, sys.executable, "-c", code, **environment)


def _installed(path: Path) -> str:
    return path.as_posix() if path.parts[0] == "notabug" else f"notabug/{path.as_posix()}"


def _data(floor: str) -> Iterator[Path]:
    """What the program reads at run time."""
    for path in tracked_below(floor):
        if path.suffix in (".html", ".css", ".usda", ".toml", ".exr", ".png", ".json"):
            yield path


def tracked_below(floor: str) -> Iterator[Path]:
    done = subprocess.run(["git", "ls-files", "-z", floor], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode == 0:
        yield from (ROOT / name for name in done.stdout.split("\0") if name and (ROOT / name).is_file())
    else:
        yield from (path for path in (ROOT / floor).rglob("*") if path.is_file())


def _copy(target: Path) -> Path:
    """A copy to build in, so that no build folder of an earlier day, or of another test, gets into the wheel."""
    skip = shutil.ignore_patterns(
        ".git", ".venv", "build", "dist", "*.egg-info", "__pycache__", ".*_cache", "notabug-out"
    )
    shutil.copytree(ROOT, target, symlinks=True, ignore=skip)
    return target


def test_every_promise_names_tests_that_are_there() -> None:
    page = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")
    named = re.findall(r"`([\w/]+\.py)::(\w+)`", page)
    assert len(named) > 30
    for file, test in named:
        text = (ROOT / "tests" / file).read_text(encoding="utf-8")
        assert f"def {test}(" in text, f"{file}::{test}"
    rows = [line for line in page.splitlines() if line.startswith("| ") and not line.startswith("| promise")]
    assert all("::test_" in row for row in rows)
