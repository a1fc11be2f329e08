"""Which LLVM is loaded decides whether Mitsuba aborts."""

from __future__ import annotations

import doctest
from pathlib import Path

import pytest

from notabug.adapters import llvm

DEBIAN = [
    "/usr/lib/x86_64-linux-gnu/libLLVM-14.so.1",
    "/usr/lib/x86_64-linux-gnu/libLLVM-15.so",
    "/usr/lib/x86_64-linux-gnu/libLLVM-16.so.1",
    "/usr/lib/llvm-18/lib/libLLVM.so",
    "/usr/lib/llvm-18/lib/libLLVM.so.1",
    "/usr/lib/x86_64-linux-gnu/libLLVM.so.18.1",
    "/usr/lib/llvm-19/lib/libLLVMCore.so",
    "/usr/lib/libLLVM.so",
]


def test_examples() -> None:
    assert doctest.testmod(llvm).failed == 0


@pytest.mark.parametrize("name", DEBIAN)
def test_versions_that_abort_are_never_chosen(name: str) -> None:
    assert llvm.choose([Path(name)]) is None


def test_lowest_able_version_is_chosen() -> None:
    able = ["/usr/lib/x86_64-linux-gnu/libLLVM.so.20.1", "/usr/lib/x86_64-linux-gnu/libLLVM-19.so"]
    assert llvm.choose(map(Path, DEBIAN + able)) == Path(able[1])


def test_choice_of_the_user_is_taken(tmp_path: Path) -> None:
    library = tmp_path / "libLLVM-21.so.1"
    library.touch()
    assert llvm.find_library({llvm.VARIABLE: str(library)}) == llvm.Library(library)


def test_choice_of_the_user_that_would_abort_is_not(tmp_path: Path) -> None:
    library = tmp_path / "libLLVM-15.so"
    library.touch()
    found = llvm.find_library({llvm.VARIABLE: str(library)})
    assert found.path != library
    assert str(library) in found.remark
