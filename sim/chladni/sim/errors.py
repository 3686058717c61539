"""What can go wrong, in two kinds: the input is wrong, or the work failed."""

from __future__ import annotations


class ChladniError(Exception):
    """Base of every error a user can meet; the CLI exits with 1."""


class InputError(ChladniError):
    """The input is wrong; the CLI exits with 2.

    Parameters
    ----------
    field
        What is wrong: a key of a file, an option, an argument.
    value
        What was given.
    expected
        What would have been right.
    file
        Where it stands, if it stands in a file.
    """

    def __init__(self, field: str, value: object, expected: str, *, file: str | None = None):
        self.field = field
        self.value = value
        self.expected = expected
        self.file = file
        place = f"{file}: " if file else ""
        super().__init__(f"{place}{field}: got {value!r}, expected {expected}")

    def in_file(self, file: str) -> InputError:
        """The same error, naming the file it came from."""
        return InputError(self.field, self.value, self.expected, file=file)


RESONANCE_BAND = 1e-6
"""An undamped drive closer than this to a mode, relative in frequency, has lost half the digits
of 1/(ω²ₘₙ − ω²) and means nothing on a real plate."""


class ResonanceError(ChladniError):
    """An undamped plate is driven at one of its modes, where its response has no bound.

    Attributes
    ----------
    mode_hz
        The mode's frequency.
    """

    def __init__(self, frequency_hz: float, mode_hz: float, mode: str):
        self.mode_hz = mode_hz
        super().__init__(
            f"drive.frequency_hz: {frequency_hz:g} Hz lies on mode {mode} ({mode_hz:.3f} Hz) of a "
            "plate without loss; expected another frequency or a plate.loss_factor above 0"
        )
