"""The pytest plug-in: what each verdict is to pytest, options and ini keys, xdist, and what it costs unused."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO  # noqa: F401 - pytester forgets what a session imports, and these cannot be imported twice
import pytest
from pxr import Sdf, Usd, UsdGeom, UsdLux, UsdRender, UsdShade  # noqa: F401

import notabug.pytest_session
from notabug.metrics.verdict import Finding, Verdict
from notabug.scenes_usd.picture import write_exr

ROOT = Path(__file__).resolve().parents[2]
PLUGIN = ("-p", "no:notabug", "-p", "notabug.pytest_plugin", "-p", "no:cacheprovider", "-p", "no:xdist")
SPHERE = "terminator/sphere"
NAME = f"notabug::{SPHERE}[grey]"


def finding(kind: Any, name: str, area: float = 100.0, visible: bool = True) -> Verdict:
    return Verdict(kind, (Finding(kind, name, area, (0, 0, 9, 9), jnd=2.0, visible=visible),), message="a sentence")


ENTRY = """
[[accepted]]
renderer = "grey"
scene = "terminator/sphere"
variant = "tessellation=24x12"
verdict = "{word}"
name = "{name}"
area_px = [90.0, 110.0]
because = "ticket 12"
models = "{models}"
"""


@pytest.fixture
def run(door: Any, pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Any:
    """pytest with the plug-in, over the renderers and the judge of ``door``."""
    monkeypatch.setattr(notabug.pytest_session, "adapters", lambda: dict(sorted(door.renderers.items())))

    def run(*words: str) -> pytest.RunResult:
        return pytester.runpytest_inprocess(*PLUGIN, *words)

    run.door = door  # type: ignore[attr-defined]
    return run


def accept(pytester: pytest.Pytester, word: str, name: str) -> None:
    text = ENTRY.format(word=word, name=name, models=notabug.pytest_session.Gate().models)
    (pytester.path / "notabug.expect.toml").write_text(text)


@pytest.mark.parametrize(
    ("verdict", "outcome", "says"),
    [
        (Verdict("pass"), "passed", ""),
        (finding("limitation", "facet_self_shadow"), "xfailed", "facet_self_shadow"),
        (finding("bug", "flat_normals"), "failed", "flat normals"),
        (Verdict("inconclusive", message="too noisy"), "skipped", "too noisy"),
        (Verdict("unsupported", message="no shadows"), "skipped", "no shadows"),
        (Verdict("error", message="it broke"), "failed", "it broke"),
    ],
)
def test_each_verdict_has_its_outcome(run: Any, verdict: Verdict, outcome: str, says: str) -> None:
    run.door.judge.verdicts[SPHERE] = verdict
    done = run("--notabug-scenes", SPHERE, "-rA")
    done.assert_outcomes(**{outcome: 1})
    assert says in done.stdout.str()


def test_what_is_accepted_is_an_xfail_and_better_than_that_fails(run: Any, pytester: pytest.Pytester) -> None:
    accept(pytester, "bug", "flat_normals")
    run.door.judge.verdicts[SPHERE] = finding("bug", "flat_normals")
    done = run("--notabug-scenes", SPHERE, "-rx")
    done.assert_outcomes(xfailed=1)
    assert "ticket 12" in done.stdout.str()
    run.door.judge.verdicts[SPHERE] = finding("bug", "flat_normals", 40.0)
    done = run("--notabug-scenes", SPHERE, "--notabug-out", "smaller")
    done.assert_outcomes(failed=1)
    assert "XPASS(strict)" in done.stdout.str()
    run("--notabug-scenes", SPHERE, "--notabug-out", "smaller", "--notabug-strict", "false").assert_outcomes(passed=1)
    run.door.judge.verdicts[SPHERE] = finding("bug", "flat_normals", 140.0)
    run("--notabug-scenes", SPHERE, "--notabug-out", "larger").assert_outcomes(failed=1)


def test_a_missing_renderer_is_skipped_or_fails_where_it_is_required(run: Any) -> None:
    run.door.renderers["gone"] = type(run.door.grey)("gone", install="apt install gone", installed=False)
    done = run("--notabug-scenes", SPHERE, "-rs")
    done.assert_outcomes(passed=1, skipped=1)
    assert "apt install gone" in done.stdout.str()
    run("--notabug-scenes", SPHERE, "--notabug-require", "gone").assert_outcomes(passed=1, failed=1)


def test_ini_keys_are_the_options(run: Any, pytester: pytest.Pytester) -> None:
    pytester.makeini(f"[pytest]\nnotabug_scenes = {SPHERE} texture/uneven_quad\nnotabug_out = there\n")
    run("-k", "sphere").assert_outcomes(passed=1, deselected=1)
    run().assert_outcomes(passed=2)
    assert (pytester.path / "there" / "run.json").is_file()
    pytester.makepyfile("def test_mine(): pass")
    run("test_ini_keys_are_the_options.py").assert_outcomes(passed=1)  # named files run alone


def test_a_wrong_scene_is_a_usage_error(run: Any) -> None:
    done = run("--notabug-scenes", "no/such")
    assert done.ret == pytest.ExitCode.USAGE_ERROR
    assert "no/such" in done.stderr.str() + done.stdout.str()


def test_the_session_leaves_a_run(run: Any, pytester: pytest.Pytester) -> None:
    run.door.judge.verdicts[SPHERE] = finding("bug", "flat_normals")
    run("--notabug-scenes", f"{SPHERE} texture/uneven_quad")
    document = json.loads((pytester.path / "notabug-out" / "run.json").read_text())
    assert {each["scene"]: each["verdict"] for each in document["results"]} == {
        SPHERE: "bug",
        "texture/uneven_quad": "pass",
    }
    assert run.door("report", "notabug-out", "--to", "junit") == 0
    assert 'failures="1"' in run.door.stdout


def test_the_fixture_judges_files_and_arrays(run: Any, pytester: pytest.Pytester) -> None:
    run.door.judge.verdicts[SPHERE] = finding("limitation", "facet_self_shadow")
    write_exr(pytester.path / "mine.exr", np.full((256, 256, 3), 0.5))
    pytester.makepyfile(
        """
        import numpy as np
        import pytest
        from notabug.scenes_usd.errors import NotabugError

        def test_mine(judge):
            assert judge("mine.exr", scene="terminator/sphere", filter="box").word == "limitation"
            image = np.zeros((256, 256, 3))
            verdict = judge([image, image], scene="terminator/sphere", variant={"tessellation": "8x4"}, noisy=True)
            assert verdict.findings[0].name == "facet_self_shadow"
            with pytest.raises(NotabugError, match="not part of a declaration"):
                judge(image, scene="terminator/sphere", colour="red")
        """
    )
    run().assert_outcomes(passed=1)


def test_unused_it_imports_nothing(pytester: pytest.Pytester) -> None:
    pytester.makepyfile(
        """
        import sys

        def test_light():
            ours = {name for name in sys.modules if name.startswith("notabug")}
            assert ours <= {"notabug", "notabug.pytest_plugin"}
            assert not {"numpy", "pxr", "OpenImageIO", "typer", "rich"} & set(sys.modules)
        """
    )
    words = [sys.executable, "-m", "pytest", "-p", "no:hypothesispytest", *PLUGIN, "-q", "--rootdir=."]
    done = subprocess.run(words, capture_output=True, text=True, cwd=pytester.path, check=False)
    assert done.returncode == 0, done.stdout


def test_it_is_registered() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["entry-points"]["pytest11"] == {"notabug": "notabug.pytest_plugin"}
