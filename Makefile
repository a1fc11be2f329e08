# Two commands on a fresh machine: `make run` and `make test`. Each does all the set-up it needs first.
# Needs Python >= 3.11, make and the network; installs a C++ compiler where there is none (see .ci/compiler), and POV-Ray,
# LLVM and Mesa where it may (see .ci/renderers).

# The first that is new enough; 3.11 is the version the pins in constraints.txt were resolved with.
PYTHON ?= $(shell for each in python3.11 python3.12 python3.13 python3 python; do \
	"$$each" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null && { command -v "$$each"; break; }; done)
BIN := .venv/bin
# Else each of the some hundred processes that the tests start would compile the project's modules anew.
unexport PYTHONDONTWRITEBYTECODE
# One more than there are processors: some tests wait for time limits, and for renderers that start.
WORKERS ?= $(shell echo $$(($$(nproc 2>/dev/null || getconf _NPROCESSORS_ONLN) + 1)))

.PHONY: help setup renderers browser run test sweep search lint format bench docs wheel sanitize clean

help:
	@echo "make run    set up, render all scenes, judge (ARGS='SCENE -r RENDERER ...' for some)"
	@echo "make test   set up, run the tests (ARGS='-k name')"
	@echo "make sweep  set up, run the further instances that make test leaves out: before a release, and where they are near"
	@echo "make search set up, look for examples that break what hypothesis tests state, other ones each time"
	@echo "make lint   set up, check format, style and types"
	@echo "make bench  set up, measure speed (ARGS='verdict --quick': how well it judges)"
	@echo "make docs   build the documentation as a site, build/site/index.html, and check its links"
	@echo "make sanitize  run a few tests on an extension that is built with sanitizers"
	@echo "make wheel  build the wheel into dist/"
	@echo "make setup  only the set-up; make clean removes it"

setup: .venv/installed renderers

# Whatever the extension is built from builds it again.
.venv/installed: pyproject.toml constraints.txt setup.py $(wildcard references/native/*.h references/native/*.cpp)
	@test -n "$(PYTHON)" || { echo "no Python >= 3.11 on PATH; install one (apt install python3 python3-venv, or pyenv install 3.11) or: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@echo "setting up .venv, once: some minutes, most of it for the download of packages"
	@test -x $(BIN)/python || "$(PYTHON)" -m venv .venv || { rm -rf .venv; echo "$(PYTHON) cannot make a virtual environment; on Debian: apt install python3-venv" >&2; exit 1; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt setuptools pybind11
	CXX=$$(.ci/compiler $(BIN)/python) && export CXX && $(BIN)/python -m pip install --quiet --disable-pip-version-check \
		--no-build-isolation -c constraints.txt -e '.[mitsuba,opengl,bench,docs,dev]'
	@touch $@

renderers: .venv/installed
	@test -e .venv/renderers || { .ci/renderers && touch .venv/renderers; } || true

run: setup
	@echo "make run: rendering and judging (ARGS=--quick for one scene of each class)"
	$(BIN)/notabug run $(ARGS)

browser: .venv/installed
	@.ci/browser || true

test: setup browser
	$(BIN)/pytest -n $(WORKERS) --dist worksteal --durations=10 $(ARGS)

sweep: setup browser
	$(BIN)/pytest -n auto --dist worksteal -m sweep $(ARGS)

search: setup
	NOTABUG_HYPOTHESIS=search $(BIN)/pytest -n auto -m hypothesis $(ARGS)

lint: .venv/installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy

format: .venv/installed
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: setup
	$(BIN)/notabug bench $(or $(ARGS),speed)

docs: .venv/installed
	$(BIN)/python docs/build_site.py $(ARGS)

wheel: .venv/installed
	CXX=$$(.ci/compiler $(BIN)/python) && export CXX && $(BIN)/python -m pip wheel --quiet --no-build-isolation --no-deps -w dist .

sanitize: .venv/installed
	.ci/sanitize $(BIN)/python

clean:
	rm -rf .venv references/_native.*.so notabug-out build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
