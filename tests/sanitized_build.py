"""A pytest plugin for `make sanitize`: the sanitized build instead of the editable installation."""

from __future__ import annotations

import importlib
import os
import sys

sys.meta_path[:] = [
    finder for finder in sys.meta_path if type(finder).__name__ != "ScikitBuildRedirectingFinder"
]
_FOUND = str(importlib.import_module("chladni.host.emulation._emulator").__file__)
if os.environ["CHLADNI_SANITIZED"] not in _FOUND:
    raise RuntimeError(f"{_FOUND} is not the sanitized build")
