"""The page: a template with its numbers filled in, and what a page says otherwise."""

from __future__ import annotations

import re
from pathlib import Path
from string import Template

from paper.numbers import Numbers, agree

TEMPLATE = Path(__file__).with_name("page.md")
PAGE = Path(__file__).resolve().parents[2] / "docs" / "paper.md"
IMAGES = PAGE.parent / "images"
ANYTHING = r"[^|\n]+?"
"""What a number of the page may be, a range of numbers or words among them."""


def filled(numbers: Numbers) -> str:
    """The page's text.

    Raises
    ------
    KeyError
        The template has a name that there is no number for.
    """
    return Template(TEMPLATE.read_text(encoding="utf-8")).substitute(numbers)


def names() -> set[str]:
    """Of all numbers in the template."""
    return set(Template(TEMPLATE.read_text(encoding="utf-8")).get_identifiers())


def differences(text: str, numbers: Numbers) -> list[str]:
    """What a page says otherwise than the template and those numbers that are given.

    A number may differ by one in its last place, and may be anything where none is given.
    """
    found = re.fullmatch(_pattern(), text)
    if found is None:
        return ["the words of the page are not those of the template"]
    return [
        f"{name}: {number} on the page, {numbers[name]} now"
        for name, number in found.groupdict().items()
        if name in numbers and not agree(number, numbers[name])
    ]


def _pattern() -> str:
    """The template as a regular expression; a name that comes again must say the same again."""
    parts, seen = [], set()
    text = TEMPLATE.read_text(encoding="utf-8")
    for words, name in re.findall(r"([^$]*)(?:\$\{(\w+)\})?", text):
        parts.append(re.escape(words))
        if name:
            parts.append(f"(?P={name})" if name in seen else f"(?P<{name}>{ANYTHING})")
            seen.add(name)
    return "".join(parts)
