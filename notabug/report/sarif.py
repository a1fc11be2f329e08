"""SARIF 2.1.0 of a run: a rule for each named artifact, a result for each finding that made a verdict."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from notabug.metrics.verdict import Finding
from notabug.report.next_steps import going_on
from notabug.report.sentence import scene_file, sentence, title
from notabug.results.document import RunDocument
from notabug.results.record import Result, json_ready
from notabug.results.wording import decisive, readable

SCHEMA = "https://json.schemastore.org/sarif-2.1.0.json"


def sarif(document: RunDocument, results: list[Result], out: Path) -> str:
    """What is wrong or known, as code scanners list it; what passes is left out."""
    listed = [(result, finding) for result in results for finding in _findings(result)]
    rules = list(dict.fromkeys(_rule(result, finding) for result, finding in listed))
    run = {
        "tool": {
            "driver": {
                "name": "notabug",
                "version": document["tool"]["version"],
                "rules": [{"id": rule, "shortDescription": {"text": readable(rule)}} for rule in rules],
            }
        },
        "invocations": [
            {"executionSuccessful": bool(document["finished"]), "commandLine": " ".join(document["command"])}
        ],
        "results": [_result(result, finding, rules, out) for result, finding in listed],
    }
    log = {"$schema": SCHEMA, "version": "2.1.0", "runs": [run]}
    return json.dumps(json_ready(log), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _findings(result: Result) -> Iterator[Finding | None]:
    """The decisive findings; None for a failure without one."""
    if result.verdict.word in ("limitation", "bug"):
        yield from decisive(result) or (None,)
    elif result.verdict.word == "error":
        yield None


def _rule(result: Result, finding: Finding | None) -> str:
    return f"{finding.kind}/{finding.name}" if finding else result.verdict.word


def _result(result: Result, finding: Finding | None, rules: list[str], out: Path) -> dict[str, object]:
    rule = _rule(result, finding)
    told = finding.message if finding and finding.message else sentence(result)
    made: dict[str, Any] = {
        "ruleId": rule,
        "ruleIndex": rules.index(rule),
        "level": "error" if result.fails else "note",
        "message": {"text": f"{title(result)}: {told}\n{going_on(result, out)}".rstrip()},
        "locations": [
            {
                "physicalLocation": {"artifactLocation": {"uri": quote(scene_file(result), errors="replace")}},
                "logicalLocations": [{"name": result.renderer, "fullyQualifiedName": title(result)}],
            }
        ],
        "partialFingerprints": {"notabug/v1": f"{title(result)} {rule}"},
    }
    properties: dict[str, Any] = {"verdict": result.verdict.word, "state": result.state}
    if finding is not None:
        properties |= {"area_px": finding.area_px, "jnd": finding.jnd, "region": list(finding.region)}
    if not result.fails and result.because:
        made["suppressions"] = [{"kind": "external", "justification": result.because}]
    return made | {"properties": properties}
