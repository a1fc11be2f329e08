"""The C++ extension notabug.references._native; everything else about the distribution is in pyproject.toml.

``CXX`` names another compiler than the one Python was built with: ``CXX='python -m ziglang c++'`` works too.
``CXXFLAGS`` are added to the flags.
"""

from __future__ import annotations

import hashlib
import os
import shlex
import sys
from pathlib import Path

from pybind11 import get_include
from pybind11.setup_helpers import ParallelCompile
from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

FOLDER = Path("references/native")
SOURCES = sorted(FOLDER.glob("*.cpp"))
HEADERS = sorted(FOLDER.glob("*.h"))
# No contraction to FMA and no fast math: results are the same to the last bit on any processor, and so without
# -march=native. Nobody reads errno of a square root.
FLAGS = ["-std=c++20", "-O3", "-ffp-contract=off", "-fno-math-errno", "-fvisibility=hidden", "-Wall", "-Wextra", "-g0"]
EXTRA = shlex.split(os.environ.get("CXXFLAGS", ""))  # of whoever builds: `make sanitize` does


def source_hash() -> str:
    """A hash of the sources, which the module tells: part of the key of whatever it computes."""
    state = hashlib.blake2b(digest_size=8)
    for path in sorted(SOURCES + HEADERS):
        state.update(path.name.encode())
        state.update(path.read_bytes())
    return state.hexdigest()


class Build(build_ext):
    """Compiles the files in parallel, by ``CXX`` where it is set."""

    def build_extensions(self) -> None:
        chosen = shlex.split(os.environ.get("CXX", ""))
        if chosen and sys.platform != "win32":
            shared = ["-bundle", "-undefined", "dynamic_lookup"] if sys.platform == "darwin" else ["-shared"]
            words = {"compiler": [], "compiler_so": ["-fPIC"], "linker_so": shared}
            names = {f"{name}{kind}": chosen + flags for name, flags in words.items() for kind in ("", "_cxx")}
            known = self.compiler.executables
            self.compiler.set_executables(**{name: words for name, words in names.items() if name in known})
        super().build_extensions()


ParallelCompile(default=os.cpu_count() or 1).install()
setup(
    cmdclass={"build_ext": Build},
    ext_modules=[
        Extension(
            "notabug.references._native",
            [path.as_posix() for path in SOURCES],
            depends=[path.as_posix() for path in HEADERS],
            include_dirs=[get_include(), FOLDER.as_posix()],
            define_macros=[("NOTABUG_SOURCES", f'"{source_hash()}"'), ("NDEBUG", None)],
            extra_compile_args=FLAGS + EXTRA,
            extra_link_args=[] if sys.platform == "win32" else ["-pthread", *EXTRA],
            language="c++",
        )
    ],
)
