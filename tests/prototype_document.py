"""The prototype's board file as a document, with one key changed."""

from __future__ import annotations

import copy
import tomllib
from typing import Any

from conftest import ROOT


def document() -> dict[str, Any]:
    text = (ROOT / "boards" / "prototype.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def set_key(path: str, value: Any) -> dict[str, Any]:
    """The prototype's document with one key changed; `None` removes it."""
    changed = copy.deepcopy(document())
    *parents, last = path.split(".")
    part: Any = changed
    for key in parents:
        part = part[int(key)] if key.isdigit() else part[key]
    if value is None:
        del part[last]
    else:
        part[last] = value
    return changed
