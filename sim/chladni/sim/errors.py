"""What can go wrong, in two kinds: the input is wrong, or the work failed."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager


class ChladniError(Exception):
    """Base of every error a user can meet; the CLI exits with 1.

    Parameters
    ----------
    text
        What went wrong.
    hint
        What to do about it; the message ends with it.
    """

    def __init__(self, text: str = "", *, hint: str = ""):
        self.hint = hint
        super().__init__(_with_hint(text, hint))


class StoppedError(ChladniError):
    """Ctrl-C ended the work; the CLI exits with 130."""


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
    hint
        Why, or what to do about it.
    """

    def __init__(
        self, field: str, value: object, expected: str, *, file: str | None = None, hint: str = ""
    ):
        self.field = field
        self.value = value
        self.expected = expected
        self.file = file
        super().__init__(hint=hint)
        self._tell()

    def in_file(self, file: str) -> InputError:
        """The error, which from now on names the file it came from."""
        self.file = file
        self._tell()
        return self

    def hinted(self, hint: str) -> None:
        """Say from now on what to do about it."""
        self.hint = hint
        self._tell()

    def on_command_line(self, options: Mapping[str, str]) -> None:
        """Speak of options, where a command line gave what Python gives as arguments.

        Parameters
        ----------
        options
            By argument.
        """

    def _tell(self) -> None:
        """Make the message, again where a part of it has changed."""
        self.args = (_with_hint(self._text(), self.hint),)

    def _text(self) -> str:
        return f"{self._place()}: expected {self.expected}, got {_shown(self.value)}"

    def _place(self) -> str:
        field = _plain(self.field)
        return f"{self.file}, {field}" if self.file else field


MOST_SHOWN = 200
"""Characters of a value, or of a key, that a message shows: both may come from a file."""


def _with_hint(text: str, hint: str) -> str:
    return f"{text}; {hint}" if hint else text


def _shown(value: object) -> str:
    try:
        text = repr(value)
    except (RecursionError, ValueError):  # nested too deep, or an integer of thousands of digits
        text = f"a {type(value).__name__} too large to show"
    return _shortened(text)


def _plain(text: str) -> str:
    """A key without what would move a terminal's cursor."""
    return _shortened("".join(c if c.isprintable() else repr(c)[1:-1] for c in text))


def _shortened(text: str) -> str:
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 1] + "…"


class MissingError(InputError):
    """Something is left out that there must be.

    Parameters
    ----------
    field, file, hint
        As of `InputError`.
    what
        What it is for; may be empty.
    """

    def __init__(self, field: str, what: str = "", *, file: str | None = None, hint: str = ""):
        super().__init__(field, None, what, file=file, hint=hint)

    def _text(self) -> str:
        return f"{self._place()} is required" + (f": {self.expected}" if self.expected else "")


class ArgumentError(InputError):
    """An argument of a function is wrong, or the file that it names.

    Parameters
    ----------
    field
        The argument; or several of them with commas between, one of them perhaps indexed.
    """

    def on_command_line(self, options: Mapping[str, str]) -> None:
        """Name the options instead, each once; an argument that is no option stays."""
        names = [options.get(name.partition("[")[0], name) for name in self.field.split(", ")]
        self.field = ", ".join(dict.fromkeys(names))
        self._tell()


class MissingArgumentError(MissingError, ArgumentError):
    """An argument is left out that there must be."""


class ConflictError(InputError):
    """Two things were given that do not go together.

    Parameters
    ----------
    field
        One of them.
    other
        The other one.
    file, hint
        As of `InputError`.
    """

    def __init__(self, field: str, other: str, *, file: str | None = None, hint: str = ""):
        super().__init__(field, None, other, file=file, hint=hint)

    def _text(self) -> str:
        return f"{self._place()} does not go with {self.expected}"


MOST_FAULTS = 20
"""Of one input, that a message lists."""


class FaultsError(InputError):
    """Several things wrong with one input, each on a line of its own.

    Parameters
    ----------
    errors
        Two or more; `field`, `value` and `expected` are the first one's.
    """

    def __init__(self, errors: Sequence[InputError]):
        self.errors = tuple(errors)
        first = self.errors[0]
        super().__init__(first.field, first.value, first.expected, file=first.file)

    def in_file(self, file: str) -> InputError:
        """All of them, in that file."""
        for error in self.errors:
            error.in_file(file)
        return super().in_file(file)

    def on_command_line(self, options: Mapping[str, str]) -> None:
        """Speak of options in each."""
        for error in self.errors:
            error.on_command_line(options)
        self._tell()

    def _text(self) -> str:
        lines = [str(error) for error in self.errors[:MOST_FAULTS]]
        more = len(self.errors) - len(lines)
        return "\n".join(lines + [f"and {more} more"] * (more > 0))


class Faults:
    """What is found wrong with an input, so that all of it is told at once.

    faults = Faults()
    with faults.kept():
        check_one_thing()
    with faults.kept():
        check_another()
    faults.tell()
    """

    def __init__(self) -> None:
        self._found: dict[str, InputError] = {}

    @contextmanager
    def kept(self) -> Iterator[None]:
        """Keep an `InputError` of the block, the first of each field, and go on after it."""
        try:
            yield
        except InputError as error:
            for one in error.errors if isinstance(error, FaultsError) else (error,):
                self._found.setdefault(one.field, one)

    def tell(self) -> None:
        """Raise what was kept: one error as it is, several as `FaultsError`."""
        found = list(self._found.values())
        if len(found) == 1:
            raise found[0]
        if found:
            raise FaultsError(found)


class TooLargeError(InputError):
    """What is asked for takes more memory than it may.

    Parameters
    ----------
    what
        Would have been done.
    needed, most
        Bytes.
    lower
        What to lower for less.
    """

    def __init__(self, what: str, needed: float, most: float, lower: str):
        self.needed, self.most = needed, most
        self.permission = "allow_large_cost(True)"
        super().__init__(what, needed, lower)

    def on_command_line(self, options: Mapping[str, str]) -> None:
        """Name the option that allows it."""
        self.permission = options.get("large", self.permission)
        self._tell()

    def _text(self) -> str:
        return (
            f"{self.field} takes about {self.needed / 1e9:.1f} GB, more than {self.most / 1e9:g}: "
            f"lower {self.expected}, or go on with {self.permission}"
        )


RESONANCE_BAND = 1e-6
"""An undamped drive closer than this to a mode, relative in frequency, has lost half the digits
of 1/(ω²ₘₙ − ω²) and means nothing on a real plate."""


WORST_ESTIMATE = 0.05
"""A field whose estimated error is above this share of it is not handed out."""


class ToleranceError(ChladniError):
    """A field does not meet the tolerance asked for, or is no field at all.

    Attributes
    ----------
    estimate, tolerance
        Relative L² errors.
    """

    def __init__(self, estimate: float, tolerance: float, closest: str = ""):
        self.estimate = estimate
        self.tolerance = tolerance
        limit = WORST_ESTIMATE if estimate > WORST_ESTIMATE else tolerance
        where = f" ({closest})" if closest else ""
        super().__init__(
            f"the field's estimated error is {estimate:.2g}, above {limit:g}",
            hint=f"move features that nearly touch apart or merge them{where}, give a plate driven "
            "at a mode a loss_factor or another frequency, or ask for another tolerance",
        )


def check_estimate(
    estimate: float, tolerance: float, *, allow_unmet: bool = False, closest: str = ""
) -> None:
    """Refuse an estimate above the tolerance, unless allowed; and any above `WORST_ESTIMATE`.

    Parameters
    ----------
    closest
        Which features are closest to each other, in words.

    Raises
    ------
    ToleranceError
        Says what would help.
    """
    if estimate > max(WORST_ESTIMATE, tolerance) or (estimate > tolerance and not allow_unmet):
        raise ToleranceError(estimate, tolerance, closest)


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
            "plate without loss",
            hint="give another frequency or a plate.loss_factor above 0",
        )
