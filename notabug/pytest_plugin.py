"""The pytest plug-in: scenes and renderers as tests, and a fixture that judges a team's own pictures.

Nothing of notabug is imported until a scene is asked for or a picture is judged.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import pytest

if TYPE_CHECKING:
    from notabug.metrics.verdict import Verdict
    from notabug.pytest_session import Bench, Image
    from notabug.results.document import ResultSaid

# Name, help, default; each is the option --notabug-NAME and the ini key notabug_NAME.
TEXTS = (
    ("scenes", "Scenes to test, as for `notabug run`: ids, classes, globs or USD files.", ""),
    ("renderers", "Renderers to test; default: all that are installed.", ""),
    ("variants", "Variants SET=NAME, or `all`.", ""),
    ("camera", "The camera, by its path; default: each scene's own.", ""),
    ("time", "The frame of animated scenes.", ""),
    ("purposes", "What is drawn beside default: render, proxy, guide; default: render.", ""),
    ("require", "Renderers that must be installed.", ""),
    ("expect", "What is accepted; default: notabug.expect.toml where it is there.", ""),
    ("out", "Folder for pictures, run.json and the report.", "notabug-out"),
    ("samples", "Samples per pixel; 0: each renderer's default.", "0"),
    ("seeds", "Independent pictures of a noisy renderer.", "4"),
    ("timeout", "Seconds for one renderer on one scene.", "600"),
    ("fail-on", "any or visible: which bugs fail.", "any"),
    ("strict", "true or false: what is better than accepted fails too.", "true"),
)


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("notabug", "rendering bugs, or really not")
    for name, says, default in TEXTS:
        dest = f"notabug_{name.replace('-', '_')}"
        group.addoption(f"--notabug-{name}", dest=dest, default=None, metavar="TEXT", help=f"{says} (ini: {dest})")
        parser.addini(dest, says, default=default)


def setting(config: pytest.Config, name: str) -> str:
    """The option --notabug-NAME, else the ini key of the same name."""
    dest = f"notabug_{name.replace('-', '_')}"
    given = config.getoption(dest)
    return str(config.getini(dest) if given is None else given).strip()


def settings(config: pytest.Config) -> dict[str, str]:
    """Every setting by its name as a word of Python."""
    return {name.replace("-", "_"): setting(config, name) for name, _, _ in TEXTS}


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "notabug: a scene drawn by a renderer and judged")
    config.pluginmanager.register(Records(config), "notabug-records")


@pytest.hookimpl(tryfirst=True)  # before -k and -m choose among the items
def pytest_collection_modifyitems(session: pytest.Session, config: pytest.Config, items: list[pytest.Item]) -> None:
    """Add the scenes: always when the option names them; by the ini key unless somebody asked for certain tests."""
    asked = config.args_source is config.ArgsSource.ARGS and config.getoption("notabug_scenes") is None
    if setting(config, "scenes") and not asked:
        items.extend(_items(session, config))


def _items(session: pytest.Session, config: pytest.Config) -> Iterator[pytest.Item]:
    from notabug.pytest_session import Bench
    from notabug.scenes_usd.errors import NotabugError

    try:
        bench = Bench.prepare(settings(config))
    except (NotabugError, ValueError) as error:
        raise pytest.UsageError(f"notabug: {error}") from None
    for name in bench.names():
        item: pytest.Item = Picture.from_parent(session, name=name, nodeid=f"notabug::{name}", bench=bench)
        item.add_marker(pytest.mark.notabug)
        yield item


class Picture(pytest.Item):
    """One scene and variant, drawn by one renderer."""

    def __init__(self, *, bench: Bench, **words: Any) -> None:
        super().__init__(**words)
        self.bench = bench
        self.record: ResultSaid | None = None

    def runtest(self) -> None:
        missing = self.bench.missing(self.name)
        if missing:
            pytest.skip(missing)
        result = self.bench.do(self.name)
        self.record = result.as_dict()
        self.user_properties += [("verdict", result.verdict.word), ("state", result.state), ("image", result.image)]
        kind, says = self.bench.outcome(result)
        if kind == "skip":
            pytest.skip(says)
        if kind == "xfail":
            pytest.xfail(says)
        if kind == "fail":
            pytest.fail(says, pytrace=False)

    def reportinfo(self) -> tuple[Path, None, str]:
        return Path("notabug"), None, self.name


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Let the result travel with the report: workers of xdist send reports only."""
    report = yield
    if isinstance(item, Picture) and call.when == "call" and item.record is not None:
        report.notabug = item.record  # type: ignore[attr-defined]
    return report


class Records:
    """Gathers the results where all reports arrive, which is not in a worker, and writes run.json and the page."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config
        self._records: list[ResultSaid] = []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        record = getattr(report, "notabug", None)
        if record is not None:
            self._records.append(record)

    def pytest_sessionfinish(self) -> None:
        if self._records and not hasattr(self._config, "workerinput"):
            from notabug.pytest_session import Bench

            Bench.prepare(settings(self._config)).write(self._records)


@pytest.fixture
def judge() -> Callable[..., Verdict]:
    """``judge(image, scene=..., **declaration)``: the verdict on a picture, or on several seeds of one.

    ``image`` is a path, an array of [height, width, 3] linear float values, or a sequence of either; ``scene`` an id
    or a USD file, ``variant`` its ``{set: name}``; ``camera``, ``time`` and ``purposes`` as the options of ``notabug
    judge``. The declaration says what is known about the renderer: ``filter``,
    ``radius``, ``precision``, ``noisy`` and the other fields of ``notabug.adapters.base.Declaration``.
    """

    def judge(
        image: Image | Sequence[Image],
        *,
        scene: str,
        variant: dict[str, str] | None = None,
        camera: str = "",
        time: float | None = None,
        purposes: Sequence[str] = (),
        **declaration: object,
    ) -> Verdict:
        from notabug.pytest_session import judged
        from notabug.scenes_usd.view import view_of

        return judged(_listed(image), scene, variant or {}, declaration, view_of(camera, time, purposes))

    return judge


def _listed(image: Image | Sequence[Image]) -> Sequence[Image]:
    return image if isinstance(image, list | tuple) else [cast("Image", image)]
