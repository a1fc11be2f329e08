"""What docs/ci offers to build servers: held to the servers' schemas, linted, and its scripts run with a stand-in.

The linters come with the extra ``dev``, actionlint where somebody has installed it. Where CI is set, a linter of the
extra that is missing is a failure.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from notabug.adapters.environment import RECIPES
from notabug.adapters.registry import adapters
from notabug.cli import app

ROOT = Path(__file__).resolve().parents[2]
CI = ROOT / "docs" / "ci"
SCHEMAS = {  # that the package check-jsonschema ships
    "action.yml": "vendor.github-actions",
    "workflow.yml": "vendor.github-workflows",
    "gitlab.yml": "vendor.gitlab-ci",
}
STAND_IN = """#!/bin/sh
echo "$@" >> calls
out=$(echo "$*" | sed -n 's/.*--out \\([^ ]*\\).*/\\1/p')
if [ -n "$out" ] && [ "$CODE" != 2 ]; then mkdir -p "$out" && echo '{}' > "$out/run.json"; fi
case $1 in run | merge) exit "$CODE" ;; *) echo "of $2" ;; esac
"""


def program(name: str) -> str:
    """The path of a linter; the test is skipped, or fails in CI, where it is not there."""
    places = os.pathsep.join((str(Path(sys.executable).parent), os.environ["PATH"]))
    found = shutil.which(name, path=places)
    return found or missing(name)


def missing(name: str) -> Any:
    """Skip, or fail in CI, which installs the extra."""
    (pytest.fail if os.environ.get("CI") else pytest.skip)(f"{name} is not installed: make setup")


def told(*words: str, folder: Path = CI, **environment: str) -> subprocess.CompletedProcess[str]:
    variables = {**os.environ, **environment}
    return subprocess.run(words, cwd=folder, env=variables, capture_output=True, text=True, check=False)


def read(name: str) -> Any:
    return yaml.safe_load((CI / name).read_text("utf-8"))


def scripts(name: str) -> list[str]:
    """Every shell script of a template."""
    document = read(name)
    if name == "gitlab.yml":
        jobs = [job for job in document.values() if isinstance(job, dict)]
        return [text for job in jobs for part in ("before_script", "script") for text in job.get(part, ())]
    steps = document["runs"]["steps"] if "runs" in document else []
    steps += [step for job in document.get("jobs", {}).values() for step in job["steps"]]
    return [step["run"] for step in steps if "run" in step]


@pytest.mark.parametrize("name", SCHEMAS)
def test_it_follows_the_servers_schema(name: str) -> None:
    if find_spec("check_jsonschema") is None:
        missing("check-jsonschema")
    from check_jsonschema.builtin_schemas import get_builtin_schema
    from jsonschema.validators import validator_for

    schema: Any = get_builtin_schema(SCHEMAS[name])
    judge = validator_for(schema)(schema)
    assert list(judge.iter_errors(json_of(name))) == []
    text = json.dumps(json_of(name))
    for right, wrong in (('"shell"', '"shel"'), ('"runs-on"', '"run-on"'), ('"parallel": 4', '"parallel": "none"')):
        assert right not in text or list(judge.iter_errors(json.loads(text.replace(right, wrong, 1)))), right


def json_of(name: str) -> Any:
    """The document as JSON has it: YAML takes the word `on` for true."""
    document = read(name)
    return {"on" if key is True else key: value for key, value in document.items()}


@pytest.mark.parametrize("name", ["action.yml", "workflow.yml"])
def test_nothing_of_it_can_be_abused(name: str, tmp_path: Path) -> None:
    """zizmor's audits; actions are named by version, which everybody can read, not by a hash."""
    rules = tmp_path / "zizmor.yml"
    rules.write_text('rules: {unpinned-uses: {config: {policies: {"*": ref-pin}}}}', "utf-8")
    done = told(program("zizmor"), "--offline", "--quiet", "--no-progress", "--config", str(rules), str(CI / name))
    assert done.returncode == 0, done.stdout + done.stderr


def test_hadolint_has_nothing_to_say_of_the_dockerfile(tmp_path: Path) -> None:
    linter = program("hadolint")
    done = told(linter, "Dockerfile")
    assert done.returncode == 0, done.stdout + done.stderr
    wrong = tmp_path / "Dockerfile"
    wrong.write_text((CI / "Dockerfile").read_text("utf-8").replace("COPY . ", "ADD . ").replace(" --yes", ""), "utf-8")
    done = told(linter, str(wrong))
    assert done.returncode == 1
    assert "DL3020" in done.stdout


@pytest.mark.parametrize("name", ["action.yml", "gitlab.yml"])
def test_shellcheck_has_nothing_to_say_of_the_scripts(name: str, tmp_path: Path) -> None:
    linter = program("shellcheck")
    assert scripts(name)
    for at, text in enumerate(scripts(name)):
        path = tmp_path / f"{at}.sh"
        path.write_text(f"set -e\n{text}\n", "utf-8")
        # 2086: in GitLab's script the words of a variable are split on purpose
        done = told(linter, "--shell", "bash", "--exclude", "SC2086" if name == "gitlab.yml" else "SC0000", str(path))
        assert done.returncode == 0, done.stdout


def test_actionlint_has_nothing_to_say(tmp_path: Path) -> None:
    """actionlint reads workflows only: the steps of the action are put into one that has the action's inputs."""
    linter = shutil.which("actionlint")
    if linter is None:
        pytest.skip("actionlint is not installed: go install github.com/rhysd/actionlint/cmd/actionlint@latest")
    action = read("action.yml")
    inputs = {name: {**said, "type": "string"} for name, said in action["inputs"].items()}
    steps = action["runs"]["steps"]
    job = {"runs-on": "ubuntu-latest", "steps": steps, "outputs": {k: v["value"] for k, v in action["outputs"].items()}}
    (tmp_path / "action.yml").write_text(
        yaml.safe_dump({"on": {"workflow_call": {"inputs": inputs}}, "jobs": {"x": job}})
    )
    for path in (CI / "workflow.yml", tmp_path / "action.yml"):
        done = told(linter, str(path))
        assert done.returncode == 0, done.stdout + done.stderr


def calls(text: str) -> Iterator[list[str]]:
    """The words of each call of notabug in a script, what the shell puts in replaced."""
    for line in text.replace("\\\n", " ").splitlines():
        if found := re.search(r"(?:^|[\s;])notabug ((?:run|merge|report|install|calibrate)\b[^|>&]*)", line):
            words = re.sub(r'"?\$\{words\[@\]\}"?|\$NOTABUG_OPTIONS', "--require povray", found[1])
            words = re.sub(r'"?\$\{\w+\[@\]\}"?|"?\$\w+/\$\w+"?', "1/2", words)
            yield [re.sub(r"\$\w+", "name", word) for word in shlex.split(words)]


def test_every_command_has_the_options_it_is_given() -> None:
    group: Any = typer.main.get_command(app)
    texts = [text for name in ("action.yml", "gitlab.yml") for text in scripts(name)]
    texts.append((CI / "Dockerfile").read_text("utf-8"))
    found = [words for text in texts for words in calls(text)]
    assert {words[0] for words in found} == {"run", "merge", "report", "install", "calibrate"}
    assert len(found) >= 12
    for words in found:
        group.commands[words[0]].make_context(words[0], words[1:], resilient_parsing=False)
    for step in [step for job in read("workflow.yml")["jobs"].values() for step in job["steps"]]:
        if options := step.get("with", {}).get("options"):
            group.commands["run"].make_context("run", options.split(), resilient_parsing=False)
            assert "--require" in options


def test_the_workflow_and_the_action_fit_each_other() -> None:
    action, workflow = read("action.yml"), (CI / "workflow.yml").read_text("utf-8")
    given = [
        step for job in read("workflow.yml")["jobs"].values() for step in job["steps"] if "docs/ci@" in step["uses"]
    ]
    assert len(given) == 2
    assert {name for step in given for name in step["with"]} <= set(action["inputs"])
    assert set(re.findall(r"steps\.notabug\.outputs\.(\w+)", workflow)) <= set(action["outputs"])
    text = (CI / "action.yml").read_text("utf-8")
    assert set(re.findall(r"inputs\.([\w-]+)", text)) == set(action["inputs"])


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    """A folder with a stand-in for notabug that writes down how it was called, and ends with the code CODE."""
    made = tmp_path / "bin" / "notabug"
    made.parent.mkdir()
    made.write_text(STAND_IN, "utf-8")
    made.chmod(0o755)
    return tmp_path


def play(stage: Path, code: int, text: str, **environment: str) -> int:
    """The exit code of a script, which ends at its first failure as on the servers."""
    path = os.pathsep.join((str(stage / "bin"), os.environ["PATH"]))
    return told(
        "bash", "-eo", "pipefail", "-c", text, folder=stage, PATH=path, CODE=str(code), **environment
    ).returncode


def step(name: str) -> str:
    return next(str(each["run"]) for each in read("action.yml")["runs"]["steps"] if each.get("name") == name)


GIVEN = {
    "SCENES": "texture/*\n my.usda",
    "RENDERERS": "a b",
    "OPTIONS": "--quick",
    "SHARD": "2/4",
    "MERGE": "",
    "OUT": "out",
}


@pytest.mark.parametrize(("code", "ends"), [(0, 0), (1, 0), (3, 0), (2, 2), (5, 5), (70, 70)])
def test_the_action_goes_on_after_a_bug_and_after_nothing_else(stage: Path, code: int, ends: int) -> None:
    (stage / "texture").mkdir()
    (stage / "texture" / "file").touch()  # which the shell would put in the place of the glob
    assert play(stage, code, step("Render and judge"), **GIVEN, GITHUB_OUTPUT=str(stage / "said")) == ends
    assert (stage / "calls").read_text() == (
        "run texture/* my.usda --quick --renderer a --renderer b --shard 2/4 --out out\n"
    )
    assert (stage / "said").read_text() == f"code={code}\n"
    assert play(stage, code, step("Gate")) == code


def test_the_action_merges_and_tells(stage: Path) -> None:
    said = {"GITHUB_OUTPUT": str(stage / "said")}
    assert play(stage, 1, step("Render and judge"), **{**GIVEN, "MERGE": "part-1 part-2", "SHARD": ""}, **said) == 0
    assert play(stage, 0, step("Tell GitHub"), OUT="out", **said) == 0
    calls_made = (stage / "calls").read_text().splitlines()
    assert calls_made[0] == "merge part-1 part-2 --out out"
    assert [each.split()[-1] for each in calls_made[1:]] == ["github", "sarif", "junit"]
    for line in (stage / "said").read_text().splitlines()[1:]:
        assert (stage / line.partition("=")[2]).read_text() == "of out\n"


def test_the_action_installs_where_there_is_something_to_install(stage: Path) -> None:
    for name in ("sudo", "apt-get", "python"):
        made = stage / "bin" / name
        made.write_text(f'#!/bin/sh\necho {name} "$@" >> calls\n')
        made.chmod(0o755)
    text, here = step("Install notabug and renderers"), {"GITHUB_ACTION_PATH": "/a/docs/ci"}
    assert play(stage, 0, text, DEBIAN="povray\ntachyon-bin-nox", EXTRAS="mitsuba,opengl", MERGE="", **here) == 0
    lines = (stage / "calls").read_text().splitlines()
    assert lines[1].endswith("povray tachyon-bin-nox")
    assert lines[2].endswith("/a/docs/ci/../..[mitsuba,opengl]")
    (stage / "calls").unlink()
    assert play(stage, 0, text, DEBIAN="povray", EXTRAS="", MERGE="part-1", **here) == 0
    assert [line.split()[-1] for line in (stage / "calls").read_text().splitlines()] == ["/a/docs/ci/../.."]


@pytest.mark.parametrize(("code", "ends"), [(0, 0), (1, 0), (3, 0), (2, 2)])
def test_gitlabs_jobs_go_on_after_a_bug_and_gate(stage: Path, code: int, ends: int) -> None:
    jobs = read("gitlab.yml")
    words = {"NOTABUG_SCENES": "texture/*", "NOTABUG_OPTIONS": "--require povray"}
    (stage / "texture").mkdir()
    (stage / "texture" / "file").touch()
    numbered = {"CI_NODE_INDEX": "2", "CI_NODE_TOTAL": "4"}
    assert play(stage, code, jobs["notabug:render"]["script"][0], **words, **numbered) == ends
    assert (stage / "calls").read_text() == "run texture/* --require povray --shard 2/4 --out part-2\n"
    if ends == 0:
        assert (stage / jobs["notabug:render"]["artifacts"]["paths"][0].replace("$CI_NODE_INDEX", "2")).is_dir()
        assert play(stage, code, jobs["notabug:gate"]["script"][0]) == code
        assert (stage / jobs["notabug:gate"]["artifacts"]["reports"]["junit"]).is_file()


def test_gitlabs_files_are_made_ones_that_notabug_obeys(tmp_path: Path) -> None:
    from notabug.scenes_usd.ownership import why_foreign

    path = tmp_path / "notabug.toml"
    path.touch()
    path.chmod(0o666)
    assert why_foreign(path)
    assert play(tmp_path, 0, read("gitlab.yml")[".notabug"]["before_script"][0]) == 0
    assert not why_foreign(path)


def test_the_image_has_what_the_set_up_installs_and_every_recipe() -> None:
    """One truth of what a renderer needs: .ci/renderers for Debian's packages, the recipes for the rest."""
    text, setup = (CI / "Dockerfile").read_text("utf-8"), (ROOT / ".ci" / "renderers").read_text("utf-8")
    wanted = {word for found in re.findall(r'missing="(?:\$missing )?([\w.-]+)"', setup) for word in found.split()}
    assert len(wanted) == 6
    assert wanted <= set(text.split())
    assert set(re.findall(r"notabug install (\w+)", text)) == set(RECIPES)
    make = (ROOT / "Makefile").read_text("utf-8")
    for words in ("setuptools pybind11", "--no-build-isolation", "constraints.txt"):
        assert words in make
        assert words in text, "the image is built with the tools of make setup"
    pythons = {recipe.python for recipe in RECIPES.values() if recipe.python}
    assert {f"python:{each}-slim-bookworm" for each in pythons} == set(re.findall(r"^FROM (\S+)", text, re.M))
    drawn = {
        words[at + 1] for words in calls(text) if words[0] == "calibrate" for at, x in enumerate(words) if x == "-r"
    }
    assert set(adapters()) - drawn == {"inhouse", "shadowmap", "zbuffer"}  # which come with notabug
