"""The JSON Schema of ``notabug.toml``, made of the same tables that reading it uses: ``docs/notabug.schema.json``."""

from __future__ import annotations

from typing import Any, Literal, get_args, get_origin

from notabug.adapters import declared
from notabug.adapters.configured import COMMAND_KEYS, FILES_KEYS, LIMIT_KEYS
from notabug.adapters.export.formats import FORMATS
from notabug.adapters.files import SUFFIXES

Schema = dict[str, Any]

_TEXT: Schema = {"type": "string"}
_WORDS: Schema = {"type": "array", "items": _TEXT}
_SIZE: Schema = {"anyOf": [{"type": "integer", "minimum": 0}, _TEXT]}
_OF_KEY: dict[str, Schema] = {
    "command": {**_WORDS, "minItems": 1, "description": "The program and its words, with {scene} and {image} in them."},
    "version": {"anyOf": [_TEXT, _WORDS], "description": "The version, or a command whose first line of output it is."},
    "scene": {"enum": sorted(FORMATS), "description": "What the program reads."},
    "image": {"enum": sorted(suffix[1:] for suffix in SUFFIXES), "description": "The suffix of what it writes."},
    "layer": {**_TEXT, "description": "The layer or part that is the picture, where a file has several."},
    "samples": {"type": "integer", "minimum": 1, "description": "Samples per pixel where a run asks for none."},
    "environment": {"type": "object", "additionalProperties": _TEXT},
    "install": {**_TEXT, "description": "How to install it: said where it is missing."},
    "server": {"type": "boolean", "description": "Started once; reads one line of JSON for each picture."},
    "start_timeout": {
        "type": "number",
        "exclusiveMinimum": 0,
        "description": "Seconds in which a server says that it is ready.",
    },
    "timeout": {"type": "number", "exclusiveMinimum": 0, "description": "Seconds for one picture."},
    "cpu": {"type": "number", "minimum": 0, "description": "Seconds of processor time for one picture; 0: no limit."},
    "memory": {**_SIZE, "description": "Bytes, or words such as 2 GiB; 0: no limit."},
    "output": {**_SIZE, "description": "Bytes that it may write."},
    "retries": {"type": "integer", "minimum": 0, "maximum": 10},
    "pixels": {"enum": sorted(declared.PIXELS), "description": "The number format of the pictures."},
    "encoding": {"enum": ["linear", "srgb"]},
    "capabilities": {"type": "array", "items": {"enum": sorted(declared.CAPABILITIES)}, "uniqueItems": True},
    "not_together": {
        "type": "array",
        "items": {
            "type": "array",
            "items": {"enum": sorted(declared.CAPABILITIES)},
            "minItems": 2,
        },
        "description": "Capabilities that it does not have together in one scene.",
    },
    "adapter": {**_TEXT, "description": "A known adapter, whose fields the other keys set."},
}
_KNOWN: Schema = {
    "title": "a known adapter, set",
    "type": "object",
    "properties": {"adapter": _OF_KEY["adapter"]},
    "not": {"anyOf": [{"required": ["command"]}, {"required": ["files"]}]},
}
_GLOBS: Schema = {**_WORDS, "description": "Globs of what else the pictures depend on."}
_FOLDER: Schema = {**_TEXT, "description": "A folder of pictures that were rendered elsewhere."}


def schema() -> Schema:
    """The schema of the file, draft 2020-12."""
    declarable = {row["key"]: _declarable(row) for row in declared.declarations()}
    command = {key: _OF_KEY.get(key, {}) for key in (*COMMAND_KEYS, *LIMIT_KEYS, *declared.KEYS)} | declarable
    files = {key: _OF_KEY.get(key, {}) for key in (*FILES_KEYS, *declared.KEYS)} | declarable
    own = {key: _OF_KEY[key] for key in ("samples",)}
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "notabug.toml: renderers to be judged",
        "type": "object",
        "additionalProperties": False,
        "properties": {
            "renderers": {
                "type": "object",
                "additionalProperties": {
                    "anyOf": [
                        _table("a program", command | own | {"files": _GLOBS}, "command"),
                        _table("a folder of pictures", files | {"files": _FOLDER}, "files"),
                        _KNOWN,
                    ]
                },
            }
        },
    }


def _table(title: str, properties: dict[str, Schema], required: str) -> Schema:
    return {
        "title": title,
        "type": "object",
        "properties": dict(sorted(properties.items())),
        "required": [required],
        "additionalProperties": False,
    }


def _declarable(row: dict[str, str]) -> Schema:
    """The schema of one key of a declaration, by the type of its field."""
    told = {"description": row["meaning"]}
    name, hint = row["key"], declared.hint(row["key"])
    if get_origin(hint) is Literal:
        return {"enum": list(get_args(hint)), **told}
    if hint in (bool, bool | None):
        return {"type": "boolean", **told}
    low, high = declared.bounds(name)
    limits = {"minimum": low} | ({"maximum": high} if high < float("inf") else {})
    return {"type": "integer" if hint is int else "number", **limits, **told}
