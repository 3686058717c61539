"""Two fingers that press at the same moment, each with its own area's effect of a device's bank."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from chladni.effects import Area, Bank, Curve, Effect, Polygon, Tone, shipped_effects
from chladni.effects.bank.layout import SIGNAL_HZ
from chladni.effects.bank.pack import pack_bank
from chladni.effects.bank.unpack import unpack_bank
from chladni.host.cli.effects.presses import of_bank
from chladni.host.cli.effects.remarks import (
    say_less_than_asked,
    say_short_places,
    say_unflattened,
)
from chladni.host.emulation.emulator import Emulator
from chladni.host.emulation.recorded_effect import (
    as_reported,
    effect_of_bank,
    recorded_effect,
    silent_at,
)
from chladni.sim.board.file import load_board
from chladni.sim.errors import InputError
from chladni.tables.table import Limits
from conftest import CommandLine
from made_up import device_of
from plate_of_bumps import responses_table

FIRST, SECOND = (-15.0, 30.0), (-15.0, -20.0)
TWO = pack_bank(
    Bank(
        "two",
        {name: shipped_effects()[name] for name in ("click", "thud", "tick")},
        (
            Area("up", Polygon.rectangle(-25.0, 20.0, -5.0, 40.0), press="click", release="tick"),
            Area("down", Polygon.rectangle(-25.0, -30.0, -5.0, -10.0), hold="thud", level_db=-3.0),
        ),
    )
)
FILE = """
[[area]]
name = "up"
rectangle_mm = [-7, 2, 7, 30]
press = "click"
[[area]]
name = "down"
rectangle_mm = [-7, -30, 7, -2]
press = "click"
"""


def test_a_press_has_the_area_that_the_panel_reports() -> None:
    """A border runs through a pixel, a little below its middle: all of it is the upper area."""
    board = load_board("strip5")
    x, y = as_reported(board, (1.0, 5.0))
    areas = (
        Area("down", Polygon.rectangle(-7.0, -30.0, 7.0, y - 1e-3), press="thud"),
        Area("up", Polygon.rectangle(-7.0, y - 1e-3, 7.0, 30.0), press="click"),
    )
    effects = {name: shipped_effects()[name] for name in ("click", "thud")}
    bank = pack_bank(Bank("two", effects, areas))
    below = (x, y - 5e-3)
    assert as_reported(board, below) == (x, y)
    assert effect_of_bank(bank, below)[0] == "down"
    (press,) = of_bank(bank, [below], board, together=False)
    assert (press.area, press.effect.name) == ("up", "click")


def pins(bank: bytes) -> NDArray[np.float64]:
    """Duties while both fingers press, as steps."""
    table = responses_table(limits=Limits(4000, 100_000, 20_000_000))
    emulator = Emulator(device_of(table), table, bank=bank)
    asked = effect_of_bank(TWO, SECOND)[1].samples(SIGNAL_HZ)
    recording, _, _ = recorded_effect(
        emulator, asked, FIRST, SECOND, None, other_plays=True, rests_s=0.0
    )
    return np.asarray(recording.duty_steps, np.float64)


def test_what_two_presses_play_is_the_sum_of_each_beside_a_silent_one() -> None:
    """The bias of switches is in all of them. Duties are rounded in all four, up or down by
    turns."""
    known = unpack_bank(TWO)
    none = pins(pack_bank(replace(known, effects=dict(map(_silent, known.effects)))))
    both, first, second = (
        pins(own) for own in (TWO, silent_at(TWO, SECOND, FIRST), silent_at(TWO, FIRST, SECOND))
    )
    assert [len(own) for own in (both, first, second)] == [len(none)] * 3
    assert np.abs(first - none).max() > 50.0
    assert np.abs(second - none).max() > 50.0
    assert np.abs(both + none - first - second).max() <= 4.0


def _silent(name: str) -> tuple[str, Effect]:
    own = shipped_effects()[name]
    nothing = Tone(0.0, own.lasts_s, Curve.constant(0.0), Curve.constant(160.0))
    return name, replace(own, parts=(nothing,))


def test_a_silent_press_is_of_its_area_alone() -> None:
    quiet = silent_at(TWO, SECOND, FIRST)
    area, effect, _ = effect_of_bank(quiet, SECOND)
    assert not effect.samples(SIGNAL_HZ).any()
    assert effect.lasts_s == pytest.approx(effect_of_bank(TWO, SECOND)[1].lasts_s, abs=1e-4)
    assert effect_of_bank(quiet, FIRST)[1].name == "click"
    assert area != effect_of_bank(quiet, FIRST)[0]
    with pytest.raises(InputError, match="in one of the areas of two"):
        silent_at(TWO, (30.0, 0.0), FIRST)


def test_pressing_together_is_of_a_bank_and_two_fingers(
    chladni: CommandLine, tmp_path: Path
) -> None:
    bank = tmp_path / "two.toml"
    bank.write_text(FILE, "utf-8")
    where = ("--at", "0,15", "--board", "strip5", "--emulator", "--together")
    for given, said in (
        (("click", "--other", "0,-12"), "--together does not go with EFFECT"),
        (("--bank", bank), "--other is required: X,Y, where the finger presses that --together"),
    ):
        refused = chladni("play", *given, *where)
        assert (refused.code, said in " ".join(refused.err.split())) == (2, True), refused.err


def test_each_of_two_presses_is_told_beside_the_other(chladni: CommandLine, tmp_path: Path) -> None:
    """Each gets less than alone: they share what coils can do. A host's effects do as much."""
    bank = tmp_path / "two.toml"
    bank.write_text(FILE, "utf-8")
    where = ("--at", "0,15", "--other", "0,-12", "--board", "strip5", "--emulator", "--json")
    alone = chladni("play", "--bank", bank, *where)
    both = chladni("play", "--bank", bank, "--together", *where)
    sent = chladni("play", "click", "--other-effect", "click", *where)
    assert (alone.code, both.code, sent.code) == (0, 0, 0), both.err
    first, second = both.json["fingers"]
    assert [first["area"], second["area"]] == ["up", "down"]
    assert 0.5 * alone.json["peak_um"] < first["peak_um"] < alone.json["peak_um"]
    for own, other in zip(both.json["fingers"], sent.json["fingers"], strict=True):
        # A bank has the place's own level in it.
        assert own["peak_um"] == pytest.approx(other["peak_um"], rel=0.2)
        assert own["over_other_effect_db"] == pytest.approx(other["over_other_effect_db"], abs=3.0)


def test_how_a_bank_is_made_flat_is_said_where_it_matters(
    capsys: pytest.CaptureFixture[str],
) -> None:
    each: Any = [SimpleNamespace(envelope_error_db=db) for db in (8.2, 0.6, None)]
    off, near, noise = each
    say_unflattened([near, noise])
    assert capsys.readouterr().err == ""
    say_unflattened([near, off])
    assert "`chladni effects build --flatten --board B`" in capsys.readouterr().err


def test_places_that_allow_less_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    """Half of the effect's largest sample is asked for: 5 µm, and nine tenths of them will do."""
    each: Any = [SimpleNamespace(peak_um=um, asked=np.array([0.1, -0.5])) for um in (4.6, 2.0)]
    say_less_than_asked(each, [10.0, 10.0], "level_um of its area")
    said = " ".join(capsys.readouterr().err.split())
    assert said == (
        "chladni: B gets 2 µm of the 5 that level_um of its area asks for by the effect's own "
        "amplitude: its place allows no more"
    )
    say_less_than_asked(each, [None, 4.0])
    say_short_places(each, None)
    assert capsys.readouterr().err == ""
    say_short_places(each, 10.0)
    assert "1 of 2 places allow less than the 5 µm that --level-um" in capsys.readouterr().err
