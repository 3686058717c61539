"""What parts cost: every part of a board has a range with dated sources, or is named as without."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from chladni.host.manufacture.board_parts import board_parts
from chladni.host.manufacture.prices import price_list
from chladni.host.manufacture.wiring.part import Part
from chladni.sim.board.electronics import Sensing
from chladni.sim.board.file import load_board, parse_board, shipped_boards
from conftest import ROOT, CommandLine

DATED = re.compile(r"undated$|20\d\d-\d\d")
UNLISTED = re.compile(r"mm, in the sheet|× 0\.[12] mm|rigid")
"""FR4 that no list has; what a board stands on, which is a builder's choice."""
PAGE = (ROOT / "docs" / "first-board.md").read_text("utf-8")
ON_RUBBER = """
name = "on-rubber"
[plate]
size_mm = [60.0, 90.0]
thickness_mm = 1.0
material = "acrylic"
[[springs]]
at_mm = [20.0, 30.0]
part = "rubber-foot-6x6"
[[screws]]
at_mm = [-20.0, 30.0]
part = "silicone-grommet-m3"
[[actuators]]
at_mm = [0.0, 0.0]
"""


def all_parts() -> list[Part]:
    boards = [load_board(name) for name in shipped_boards()]
    boards += [replace(load_board(name), sensing=Sensing(36)) for name in ("phone5", "prototype")]
    boards.append(parse_board(ON_RUBBER, file="on-rubber.toml"))
    boards.append(parse_board(ON_RUBBER.replace("acrylic", "FR4"), file="of-fr4.toml"))
    return [part for board in boards for part in board_parts(board)]


def test_every_part_has_a_price_but_thin_sheets_and_the_ground() -> None:
    without = [part for part in all_parts() if price_list().find(part) is None]
    assert without
    assert [part.value for part in without if not UNLISTED.search(part.value)] == []


def test_every_price_is_of_a_part_and_says_who_sells_it_by_which_lists() -> None:
    used = {price_list().find(part) for part in all_parts()}
    for price in price_list().prices:
        assert price in used, price
        assert 0.0 < price.low <= price.high
        assert price.sold_by
        assert price.sources
        assert all(DATED.search(source) for source in price.sources), price.sources


def test_a_board_costs_what_its_parts_do() -> None:
    """`strip5` by hand: five of magnets, bridges, resistors and capacitors, one of the rest."""
    low = 5 * (0.15 + 1.0 + 0.002 + 0.003) + 2.0 + 8.0 + 0.05 + 0.04 + 0.04 + 3.3 + 0.5 + 2.0
    high = 5 * (1.0 + 6.1 + 0.1 + 0.1) + 60.0 + 15.0 + 2.1 + 0.8 + 0.4 + 12.0 + 8.0 + 15.0
    found = price_list().total(board_parts(load_board("strip5")))
    assert found == pytest.approx((low, high), abs=0.01)


def test_what_is_bought_once_costs_as_much_for_any_count() -> None:
    coils = [Part("coil", count, "15 Ω", "") for count in (1, 16)]
    assert price_list().total(coils[:1]) == price_list().total(coils[1:])
    assert price_list().find(Part("moon dust", 1, "1 g", "")) is None


@pytest.mark.parametrize(
    "row", re.findall(r"^\| .*`.*\|$", (ROOT / "docs/first-board.md").read_text("utf-8"), re.M)
)
def test_the_page_has_the_sums(row: str) -> None:
    cells = [cell.strip() for cell in row.split("|")[1:-1]]
    for name in re.findall(r"`(\w+)`", cells[0]):
        board = load_board(name)
        low, high = price_list().total(board_parts(board))
        assert cells[4] == f"{low:.0f} to {high:.0f}"
        assert int(cells[1]) == len(board.actuators)
        assert cells[2].replace("-", "").lower() == board.electronics.chip
        sides = [float(side) for side in cells[3].split(" × ")]
        assert sides == pytest.approx([1e3 * side for side in board.plate.size])
    assert price_list().checked.isoformat() in PAGE


def test_plastics_are_sold_where_plastics_are() -> None:
    text = ON_RUBBER.replace("acrylic", "polycarbonate").replace("1.0", "4.0", 1)
    (plate, *_) = board_parts(parse_board(text, file="on-rubber.toml"))
    assert price_list().find(plate) is None
    assert price_list().sold_by(plate) == "plastics shops"


def test_a_sheet_of_the_usual_thickness_has_a_price() -> None:
    template = load_board(ROOT / "boards" / "template.toml")
    (plate,) = [part for part in board_parts(template) if part.part == "plate"]
    assert price_list().find(plate) is not None  # FR4 of 1.6 mm, by its modulus


def test_the_command_sums_and_names_what_has_no_price(chladni: CommandLine) -> None:
    found = chladni("board", "parts", "strip5", "--json").json
    assert found["price_usd"] == [21.71, 149.8]
    assert found["prices_checked"] == price_list().checked.isoformat()
    by_name = {part["part"]: part for part in found["parts"]}
    assert by_name["magnet"]["price_usd"] == [0.75, 5.0]
    assert by_name["plate"]["price_usd"] is None
    shown = chladni("board", "parts", "strip5")
    told = " ".join(shown.out.split())
    assert told.startswith("The parts cost 22 to 150 US$. Not counted: plate (no list has it; sold")
