"""Names that a package offers, loaded when they are first asked for.

A package's face is loaded with every module below it, and would load all it offers: SciPy takes
half a second of every command, also of one that only asks a device for its state.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import Any


def lazy_names(package: str, places: Mapping[str, Sequence[str]]) -> Callable[[str], Any]:
    """`__getattr__` of a package: a name is loaded from its place, and kept.

    No name may be that of a module beside it: Python puts modules there when they are loaded.

    Parameters
    ----------
    places
        Modules below `package`, and the names that each has.
    """
    place_of = {name: place for place, names in places.items() for name in names}

    def load(name: str) -> Any:
        if name not in place_of:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        value = getattr(import_module(f"{package}.{place_of[name]}"), name)
        setattr(sys.modules[package], name, value)
        return value

    return load
