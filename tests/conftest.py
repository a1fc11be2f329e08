"""Fixtures for all floors: the real renderers, where they are installed.

A test that needs a renderer that is not there is skipped with the install line; it fails instead where the environment
variable NOTABUG_REQUIRE names the renderer (names joined by commas), so that a machine that should have it cannot pass
by skipping.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

import hypothesis
import pytest
from filelock import FileLock

from notabug.adapters.babylon import Babylon
from notabug.adapters.base import Adapter, RendererMissingError
from notabug.adapters.cycles import Cycles
from notabug.adapters.filament import Filament
from notabug.adapters.luxcore import LuxCore
from notabug.adapters.mitsuba import Mitsuba
from notabug.adapters.opengl import OpenGL
from notabug.adapters.panda3d import Panda3D
from notabug.adapters.povray import PovRay
from notabug.adapters.pygfx import Pygfx
from notabug.adapters.tachyon import Tachyon
from notabug.adapters.threejs import ThreeJs
from notabug.adapters.vtk import Vtk

# The same examples each time, so that the test command gives the same answer twice. `make search` looks for others.
hypothesis.settings.register_profile("same", derandomize=True, database=None, deadline=None)
hypothesis.settings.register_profile("search", derandomize=False, deadline=None, print_blob=True)
hypothesis.settings.load_profile(os.environ.get("NOTABUG_HYPOTHESIS", "same"))


@pytest.fixture(autouse=True, scope="session")
def _trust_our_own_scenes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Scenes that tests write are read at once; tests of the fences take this away again."""
    os.environ["NOTABUG_TRUST"] = str(tmp_path_factory.getbasetemp())
    yield
    del os.environ["NOTABUG_TRUST"]


pytest_plugins = ["pytester"]


@pytest.hookimpl(tryfirst=True)  # before marks choose among the tests
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Refuse a name that holds a set, and mark what `sweep_except` leaves to `make sweep`.

    A set's order, and so the name of such a test, changes from process to process.
    """
    for item in items:
        call = getattr(item, "callspec", None)
        sets = [value for value in call.params.values() if isinstance(value, (set, frozenset))] if call else []
        if call and any(str(value) in call.id for value in sets):
            raise pytest.UsageError(f"{item.nodeid}: the name of a test holds a set; give the test an id")
    some = any("::" in word for word in config.args)  # of a test, perhaps not all instances
    mark_sweeps(items, complete=not some)


def mark_sweeps(items: list[pytest.Item], *, complete: bool) -> None:
    """Mark the instances that `sweep_except` does not name; an id that no instance has is a mistake."""
    names: dict[str, set[str]] = {}
    missing: dict[str, set[str]] = {}
    for item in items:
        for mark in item.iter_markers("sweep_except"):
            name, _, id_ = item.nodeid.rstrip("]").partition("[")
            names[name] = set(mark.args)
            missing.setdefault(name, set(mark.args)).discard(id_)
            if id_ not in names[name]:
                item.add_marker(pytest.mark.sweep)
    for name, ids in missing.items():
        if complete and ids:
            raise pytest.UsageError(f"{name}: sweep_except names instances that are not there: {sorted(ids)}")


Shared = Callable[[str, Callable[[Path], object]], Path]


@pytest.fixture(scope="session")
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    """``shared(name, make)`` is a folder that ``make`` has filled: once, however many processes run the tests."""
    base = tmp_path_factory.getbasetemp()
    base = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base

    def folder(name: str, make: Callable[[Path], object]) -> Path:
        made, done = base / f"shared-{name}", base / f"shared-{name}.done"
        with FileLock(f"{made}.lock"):
            if not done.exists():
                shutil.rmtree(made, ignore_errors=True)  # what a process that failed has left
                made.mkdir()
                make(made)
                done.touch()
        return made

    return folder


Installed = TypeVar("Installed", bound=Adapter)


def _installed(adapter: Installed) -> Installed:
    try:
        adapter.find()
    except RendererMissingError as missing:
        if adapter.name in os.environ.get("NOTABUG_REQUIRE", "").split(","):
            pytest.fail(f"NOTABUG_REQUIRE names {adapter.name}, but {missing}")
        pytest.skip(str(missing))
    return adapter


@pytest.fixture(scope="session")
def povray() -> PovRay:
    """The POV-Ray adapter."""
    return _installed(PovRay())


@pytest.fixture(scope="session")
def mitsuba() -> Mitsuba:
    """The Mitsuba adapter."""
    return _installed(Mitsuba())


@pytest.fixture(scope="session")
def opengl() -> OpenGL:
    """The OpenGL adapter."""
    return _installed(OpenGL())


@pytest.fixture(scope="session")
def babylon() -> Babylon:
    """The Babylon.js adapter, in a browser."""
    return _installed(Babylon())


@pytest.fixture(scope="session")
def cycles() -> Cycles:
    """The Cycles adapter."""
    return _installed(Cycles())


@pytest.fixture(scope="session")
def filament() -> Filament:
    """The Filament adapter, in a process that stays."""
    return _installed(Filament())


@pytest.fixture(scope="session")
def luxcore() -> LuxCore:
    """The LuxCore adapter."""
    return _installed(LuxCore())


@pytest.fixture(scope="session")
def panda3d() -> Panda3D:
    """The Panda3D adapter."""
    return _installed(Panda3D())


@pytest.fixture(scope="session")
def pygfx() -> Pygfx:
    """The pygfx adapter."""
    return _installed(Pygfx())


@pytest.fixture(scope="session")
def tachyon() -> Tachyon:
    """The Tachyon adapter."""
    return _installed(Tachyon())


@pytest.fixture(scope="session")
def threejs() -> ThreeJs:
    """The three.js adapter, in a browser."""
    return _installed(ThreeJs())


@pytest.fixture(scope="session")
def vtk() -> Vtk:
    """The VTK adapter."""
    return _installed(Vtk())
