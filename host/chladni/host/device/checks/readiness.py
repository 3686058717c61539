"""Whether a device would play, and if not what keeps it from playing and what to do."""

from __future__ import annotations

from typing import Any, NamedTuple

from chladni.host.device.wires.link import LinkError

HOST_CLEARS = {"brown-out", "short starts in a row"}
"""A host that plays is trusted after these (core/device/starts.cpp)."""
OF_THE_TABLE = {"no table", "table refused"}
"""A host's own drives need no table."""
WARNINGS = {"older table", "network held back"}
"""They stand, and the device plays all the same."""


COIL_HOT = "coil hot"
"""A device that was just switched on is not sure that its coils have cooled."""


class Obstacle(NamedTuple):
    """What keeps a device from playing, and what to do about it."""

    text: str
    hint: str


def what_stands(info: dict[str, Any], *, by_host: bool = False) -> list[str]:
    """Causes that keep a device from playing; parameters as of `obstacle`."""
    forgiven = WARNINGS | HOST_CLEARS | (OF_THE_TABLE if by_host else set())
    return [cause for cause in info["standing"] if cause not in forgiven]


def obstacle(
    info: dict[str, Any], *, is_emulated: bool = False, by_host: bool = False
) -> Obstacle | None:
    """What keeps a device from playing; None where nothing does.

    Parameters
    ----------
    info
        As of `Device.info`.
    is_emulated
        Whether its table comes from a command line.
    by_host
        Whether a host's own drives are to be played, which need no table.
    """
    standing = what_stands(info, by_host=by_host)
    if not standing:
        return None
    hint = "`chladni device info` shows its faults"
    if "never configured" in standing:
        then = ", then chladni flash T.chl" if "no table" in standing else ""
        hint = f"chladni device config set --from BOARD{then}"
    elif "no table" in standing:
        hint = "give it one by --table T.chl" if is_emulated else "chladni flash T.chl"
    elif standing == [COIL_HOT]:
        hint = "wait until the coils have cooled, some seconds after power came on"
    return Obstacle(f"the device plays nothing: {', '.join(standing)}", hint)


def check_ready(info: dict[str, Any], *, is_emulated: bool = False, by_host: bool = False) -> None:
    """Raise `LinkError` if something keeps a device from playing; parameters as of `obstacle`."""
    found = obstacle(info, is_emulated=is_emulated, by_host=by_host)
    if found is not None:
        raise LinkError(found.text, hint=found.hint)
