"""How hard a test tries: a sample of fixed seed in `make test`, more and other ones in `make soak`.

`tools/soak.py` sets CHLADNI_SOAK_SEED, another one each round, and prints it.
"""

from __future__ import annotations

import os

_ROUND = os.environ.get("CHLADNI_SOAK_SEED")
IS_SOAKING = _ROUND is not None


def tries(quick: int, soaking: int) -> int:
    """How many cases: few in `make test`."""
    return soaking if IS_SOAKING else quick


def seed(own: int) -> int:
    """A test's own seed, or one of this round."""
    return own if _ROUND is None else own + 1_000_003 * int(_ROUND)
