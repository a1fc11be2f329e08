"""JUnit XML of a run: a suite for each renderer, a case for each scene and variant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from xml.etree import ElementTree

from notabug.report.next_steps import going_on
from notabug.report.sentence import sentence
from notabug.results.document import RunDocument
from notabug.results.record import Result

_FORBIDDEN = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")  # by XML 1.0
SKIPPED = frozenset({"unsupported", "inconclusive"})


def junit(document: RunDocument, results: list[Result], out: Path) -> str:
    """The run ``document`` as one XML document; what fails is a failure, an error that fails an error."""
    suites = ElementTree.Element("testsuites", name="notabug")
    for renderer in dict.fromkeys(result.renderer for result in results):
        own = [result for result in results if result.renderer == renderer]
        version = document["renderers"].get(renderer, {}).get("version", "")
        _suite(suites, _text(f"notabug.{renderer}"), own, version, out)
    for renderer, found in document["renderers"].items():
        if "missing" in found:
            suite = _counts(suites, _text(f"notabug.{renderer}"), tests=1, skipped=1)
            case = ElementTree.SubElement(suite, "testcase", classname=_text(renderer), name="installed", time="0")
            ElementTree.SubElement(case, "skipped", message=_text(f"not installed: {found['missing']}"))
    ElementTree.indent(suites)
    return ElementTree.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _suite(suites: ElementTree.Element, name: str, results: Sequence[Result], version: str, out: Path) -> None:
    errors = sum(result.fails and result.verdict.word == "error" for result in results)
    suite = _counts(
        suites,
        name,
        tests=len(results),
        failures=sum(result.fails for result in results) - errors,
        errors=errors,
        skipped=sum(not result.fails and result.verdict.word in SKIPPED for result in results),
        time=sum(sum(result.seconds.values()) for result in results),
    )
    properties = ElementTree.SubElement(suite, "properties")
    ElementTree.SubElement(properties, "property", name="renderer_version", value=_text(version))
    for result in results:
        _case(suite, result, out)


def _counts(
    suites: ElementTree.Element,
    name: str,
    *,
    tests: int,
    failures: int = 0,
    errors: int = 0,
    skipped: int = 0,
    time: float = 0.0,
) -> ElementTree.Element:
    counts = {"tests": tests, "failures": failures, "errors": errors, "skipped": skipped}
    texts = {key: str(value) for key, value in counts.items()}
    return ElementTree.SubElement(suites, "testsuite", {"name": name, **texts, "time": f"{time:.3f}"})


def _case(suite: ElementTree.Element, result: Result, out: Path) -> None:
    name = result.scene + (f"[{result.variant}]" if result.variant else "")
    seconds = f"{sum(result.seconds.values()):.3f}"
    case = ElementTree.SubElement(suite, "testcase", classname=_text(result.renderer), name=_text(name), time=seconds)
    said = _text(sentence(result))
    word = result.verdict.word
    if result.fails:
        kind = "error" if word == "error" else "failure"
        failed = ElementTree.SubElement(case, kind, message=said, type=result.state if word != "error" else "error")
        failed.text = _text(f"{said}\n{going_on(result, out)}")
    elif word in SKIPPED:
        ElementTree.SubElement(case, "skipped", message=said)
    output = ElementTree.SubElement(case, "system-out")
    output.text = said


def _text(text: str) -> str:
    """``text`` without the characters that XML has no way to write."""
    return _FORBIDDEN.sub("\ufffd", text)
