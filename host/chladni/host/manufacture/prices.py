"""What a board's parts cost, by public lists that `prices.toml` names."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date
from functools import cache
from pathlib import Path

from chladni.host.manufacture.wiring.part import Part
from chladni.sim.files import read_text

PRICES = Path(__file__).with_name("prices.toml")
MOST_BYTES = 65_536
RESISTORS = (
    "gate resistor", "gate pull-down", "EN pull-down", "bus pull-up", "reset pull-up",
    "sensing resistor", "reference resistor", "nSLEEP pull-up", "coil pull-down",
    "amplifier resistor",
)  # fmt: skip
"""Parts that are resistors by another name."""


ALSO_SOLD_BY = {
    "plate": "dealers in laminates, shim stock and thin sheets",
    "earth wire": "hobby shops",
    "ground plate": "plastics and metal shops",
    "touch panel": "shops for chips: makers of boards or touch glass etch the electrodes",
}
"""Of parts that no list has a price for."""
OF_PLATES = {
    "acrylic": "plastics shops",
    "polycarbonate": "plastics shops",
    "glass": "shops for technical glass, cut to size with ground edges",
}
"""The same of plates that are no laminate, by their material."""


@dataclass(frozen=True)
class Price:
    """A range that lists have for a part, US dollars.

    Attributes
    ----------
    part, value
        Of the parts list; `value` is a regular expression that is looked for.
    low, high
        Of one, or of what is bought once for a board.
    is_each
        Whether it is of one.
    sold_by
        Kinds of suppliers.
    sources
        Lists, with their dates.
    """

    part: str
    value: str
    low: float
    high: float
    is_each: bool
    sold_by: str
    sources: tuple[str, ...]

    def of(self, count: int) -> tuple[float, float]:
        """So many of it."""
        times = count if self.is_each else 1
        return round(times * self.low, 3), round(times * self.high, 3)


@dataclass(frozen=True)
class PriceList:
    """All prices, in the order in which they are looked through, and when they were looked up."""

    checked: date
    prices: tuple[Price, ...]

    def find(self, part: Part) -> Price | None:
        """The price of a part; None where no list had it."""
        name = "resistor" if part.part in RESISTORS else part.part.removesuffix(" with a grommet")
        for price in self.prices:
            if price.part == name and re.search(price.value, part.value):
                return price
        return None

    def sold_by(self, part: Part) -> str | None:
        """Kinds of suppliers of a part, if any are known."""
        price, also = self.find(part), ALSO_SOLD_BY.get(part.part)
        if part.part == "plate":
            also = OF_PLATES.get(part.value.split(",")[0], also)
        return price.sold_by if price else also

    def total(self, parts: Sequence[Part]) -> tuple[float, float]:
        """Of all parts that have a price."""
        ranges = [price.of(part.count) for part in parts if (price := self.find(part))]
        return round(sum(low for low, _ in ranges), 2), round(sum(high for _, high in ranges), 2)


@cache
def price_list() -> PriceList:
    """What `prices.toml` holds."""
    document = tomllib.loads(read_text(PRICES, "prices", MOST_BYTES, "a price list"))
    prices = []
    for entry in document["price"]:
        is_each = "each_usd" in entry
        low, high = entry["each_usd" if is_each else "order_usd"]
        prices.append(
            Price(
                entry["part"],
                entry.get("value", ""),
                low,
                high,
                is_each,
                entry["sold_by"],
                tuple(entry["sources"]),
            )
        )
    return PriceList(document["checked"], tuple(prices))
