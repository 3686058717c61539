"""What a device says of itself as rows for people, in words and units."""

from __future__ import annotations

from typing import Any


def info_rows(info: dict[str, Any]) -> dict[str, Any]:
    """`Device.info` and its faults by rows; `link` and `faults` are added to the answer."""
    table = "none"
    if info["table_bytes"]:
        table = (
            f"{info['table_status']}, for {info['board']}, {info['table_bytes']:,} bytes, "
            f"{info['frequency_millihertz'] / 1e3:g} Hz, slot {info['slot']}"
        )
    elif info["table_status"] != "no table":
        table = info["table_status"]
    return {
        "state": info["state"],
        "playing prevented by": ", ".join(info["standing"]) or "nothing",
        "table": table,
        "effect bank": _bank(info.get("bank")),
        "configuration": info["config_status"],
        "panel": info["panel_health"],
        "chip": info["chip"],
        "channels": info["channels"],
        "coils draw now": f"{info['supply_ma']} mA from the supply",
        "coils": ", ".join(f"{rise:.1f}" for rise in info["coil_rise_k"]) + " K above the air",
        "up for": f"{info['uptime_ms'] / 1e3:.1f} s",
        "samples missed": info["missed"],
        "flash": f"{info['updates']} updates, {100.0 * info['flash_life_used']:.2g} % of its life "
        f"used at most; {info['erases']} sectors erased since power came on",
        "stack never used": f"{info['stack_free']} bytes" if info["stack_free"] else "not known",
        "link protocol": info["link"],
        "faults": "; ".join(
            f"{f['cause']} ({f['detail']}) at {f['at_ms'] / 1e3:.1f} s" for f in info["faults"]
        )
        or "none",
    }


def _bank(bank: dict[str, Any] | None) -> str:
    if bank is None or bank["status"] == "no effect bank":
        return "none"
    if bank["status"] != "ok":
        return str(bank["status"])
    return f"{bank['name']}, {bank['effects']} effects, {bank['areas']} areas"


OF_TABLE = (
    "what the device reckons from its table; `chladni play` and `chladni fingers` solve the plate, "
    "and most often find fewer"
)
KNOWN_DB = 30.0
"""Beyond it a table's places and a board that is not its file decide: two fingers for which a
table of `strip5` reckons 50 to 72 dB have 28 to 56 by the emulated pins."""
OF_REAL_GAINS = "with real gains, as effects of the bank in flash need them: "
"""Fewer than with a table alone, whose tones have phases too."""


def finger_rows(fingers: list[dict[str, Any]], *, has_bank: bool) -> dict[str, str]:
    """`Device.fingers.all` by rows: where each is, and how far it is kept apart.

    `has_bank`: whether a bank in flash makes their signals.
    """
    rows = {}
    for one in fingers:
        x, y = one["place_mm"]
        apart, level = one["isolation_db"], one["level_db"]
        text = f"{x:g}, {y:g} mm"
        if level is not None:
            text += f", {-level:.0f} dB below the loudest"
        if apart is not None:
            text += f", the others have {_less(apart)} of it by the table"
        rows[f"finger {one['finger']}"] = text
    if any(one["isolation_db"] is not None for one in fingers):
        rows["these dB"] = has_bank * OF_REAL_GAINS + OF_TABLE
    return rows


def known_isolation(apart: float | None) -> float | str | None:
    """What a device reckons by its table, dB, no further than a table tells."""
    return apart if apart is None or apart <= KNOWN_DB else f"over {KNOWN_DB:.0f} dB"


def _less(apart: float) -> str:
    known = known_isolation(apart)
    if isinstance(known, str):
        return f"{known} less"
    return f"{abs(apart):.0f} dB {'less' if apart >= 0.0 else 'more'}"
