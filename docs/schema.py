"""``python docs/schema.py``: writes docs/notabug.schema.json; a test says when it is out of date."""

from __future__ import annotations

import json
from pathlib import Path

from notabug.adapters.schema import schema

PATH = Path(__file__).with_name("notabug.schema.json")


def text() -> str:
    return json.dumps(schema(), indent=1, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    PATH.write_text(text(), encoding="utf-8")
