"""Landlock: this process gives up the right to open files, but for those below the folders that it names.

It is a part of Linux since 5.13 that needs no privilege. Where the system has none, or forbids it, nothing is given up
and ``confine`` says so: it is a second fence behind checks that hold by themselves.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
from collections.abc import Iterable
from pathlib import Path

# System calls of the same number on every architecture, and the rights of linux/landlock.h.
_CREATE, _ADD, _RESTRICT = 444, 445, 446
_VERSION = 1  # flag of _CREATE: tell the version
_PATH_BENEATH = 1
_NO_NEW_PRIVILEGES = 38  # of prctl(2)
_EXECUTE, _WRITE_FILE, _READ_FILE, _READ_FOLDER = 1, 2, 4, 8
_READ = _EXECUTE | _READ_FILE | _READ_FOLDER
_OF_FILES = _EXECUTE | _WRITE_FILE | _READ_FILE  # what a rule for a file may hold
_ALL_OF_VERSION_1 = (1 << 13) - 1  # these, and removing and making of every kind


SYSTEM = ("/usr", "/lib", "/lib64", "/opt", "/nix", "/proc", "/sys", "/dev", "/etc/ld.so.cache", "/etc/localtime")


def programs() -> set[Path]:
    """Where Python, its packages, this one and the system's libraries are: every child must be able to read them."""
    named = {Path(each) for each in (sys.prefix, sys.base_prefix, *sys.path, *SYSTEM) if each}
    return named | {Path(__file__).resolve().parents[1]}  # which an editable installation has elsewhere


class _Rights(ctypes.Structure):
    _fields_ = (("handled", ctypes.c_uint64),)


class _Beneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = (("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32))


def confine(readable: Iterable[Path], writable: Iterable[Path] = ()) -> bool:
    """From now on this process, and what it starts, reads below ``readable`` and writes below ``writable`` only.

    False where the system cannot do that; then nothing has changed.
    """
    if not sys.platform.startswith("linux"):
        return False
    call = ctypes.CDLL(None, use_errno=True).syscall
    call.restype = ctypes.c_long
    if call(_CREATE, None, ctypes.c_size_t(0), _VERSION) < 1:
        return False
    rights = _Rights(_ALL_OF_VERSION_1)
    rules = call(_CREATE, ctypes.byref(rights), ctypes.c_size_t(ctypes.sizeof(rights)), 0)
    if rules < 0:
        return False
    try:
        for path in readable:
            _allow(call, rules, path, _READ)
        for path in writable:
            _allow(call, rules, path, _ALL_OF_VERSION_1)
        if ctypes.CDLL(None).prctl(_NO_NEW_PRIVILEGES, 1, 0, 0, 0):
            return False
        return bool(call(_RESTRICT, rules, 0) == 0)
    finally:
        os.close(rules)


def _allow(call: ctypes._NamedFuncPointer, rules: int, path: Path, rights: int) -> None:
    """Allow ``rights`` at and below ``path``; what is not there needs no rule."""
    with contextlib.suppress(OSError):
        opened = os.open(path, os.O_PATH | os.O_CLOEXEC)
        try:
            rule = _Beneath(rights if path.is_dir() else rights & _OF_FILES, opened)
            call(_ADD, rules, _PATH_BENEATH, ctypes.byref(rule), 0)
        finally:
            os.close(opened)
