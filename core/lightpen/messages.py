"""Messages to the user: a code with values; the catalogue has the text.

The core raises a message by its code; ``messages.json`` holds its English template.
The command line prints English; the wizard looks the template up in its language. A
message names no command and no button, as both show it: each adds its own advice by the
code. Stored messages keep code and values, so that they print in any language later.
"""

import json
from collections import ChainMap
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from enum import StrEnum, unique
from pathlib import Path
from typing import TypeAlias, Union

Value: TypeAlias = Union[str, int, float, "Message", tuple["Message", ...]]
Translate: TypeAlias = Callable[[str], str]

TRANSLATED: dict[str, str] = {}  # templates that are shown in other languages, too
_ENGLISH: dict[str, str] = {}  # those of the command line
CATALOGUE: Mapping[str, str] = ChainMap(TRANSLATED, _ENGLISH)


def add_messages(file: Path) -> None:
    """Add the messages of a file: by language, code and template with named values."""
    messages = json.loads(file.read_bytes())
    TRANSLATED.update(messages["translated"])
    _ENGLISH.update(messages["english"])


add_messages(Path(__file__).with_suffix(".json"))


def in_english(template: str) -> str:
    """Return a template unchanged."""
    return template


@dataclass(frozen=True)
class Message:
    """A message, or a few words that are part of one."""

    code: str  # key of the template in the catalogue; it stays when the words change
    # For the fields of the template; a tuple of messages is joined by commas.
    values: Mapping[str, Value] = field(default_factory=dict)

    @property
    def template(self) -> str:
        """The English words, with a field for each value."""
        return CATALOGUE[self.code]

    def text(self, translate: Translate = in_english) -> str:
        """Return the words, in English unless a translation of templates is given."""
        words = {name: _worded(value, translate) for name, value in self.values.items()}
        return translate(self.template).format(**words)

    def parts(self) -> Iterator["Message"]:
        """Return the message and all messages among its values."""
        yield self
        for value in self.values.values():
            for each in value if isinstance(value, tuple) else (value,):
                if isinstance(each, Message):
                    yield from each.parts()

    def __str__(self) -> str:
        return self.text()


def printable(text: str) -> str:
    """Return a text with unprintable characters escaped."""
    if text.isprintable():
        return text
    return "".join(
        character if character.isprintable() else ascii(character)[1:-1]
        for character in text
    )


def message(code: str, /, **values: Value | Path) -> Message:
    """Return a message of the catalogue; its code is a literal, for tools to find.

    Unprintable characters of paths are escaped.
    """
    return Message(code, message_values(values))


def message_values(values: Mapping[str, Value | Path]) -> dict[str, Value]:
    """Return the values of a message, with paths as text."""
    return {
        name: printable(str(value)) if isinstance(value, Path) else value
        for name, value in values.items()
    }


class Number(float):
    """A number that is written without a sign before zero."""

    def __format__(self, spec: str) -> str:
        text = super().__format__(spec)
        return text if any(map(text.__contains__, "123456789in")) else text.lstrip("-")


COMMA = message("list.comma")  # between the messages or words of one value


def _worded(value: Value, translate: Translate) -> str | int | float:
    if isinstance(value, Message):
        return value.text(translate)
    if isinstance(value, tuple):
        return COMMA.text(translate).join(each.text(translate) for each in value)
    return Number(value) if isinstance(value, float) else value


MANY_SIDES = 4  # of eight; more are not listed one by one


@unique
class Code(StrEnum):
    """Names each message, for the words and signs that a screen adds to it."""

    SHOW_PEN = "swing.show-pen"
    SEAT_TIP = "swing.seat-tip"
    SWING_TO_SEAT = "swing.swing-to-seat"
    HOLD_STILL = "swing.hold-still"
    STARTS_IN = "swing.starts-in"
    HOLD_UPRIGHT = "swing.hold-upright"
    LEAN_TO_YOUR_RIGHT = "swing.lean-to-your-right"
    FOLLOW_ARROW = "swing.follow-arrow"
    FEW_LEDS = "swing.few-leds"
    TOO_FAST = "swing.too-fast"
    BAD_FIT = "swing.bad-fit"
    TIP_SLIPPED = "swing.tip-slipped"
    PEN_LOST = "swing.pen-lost"
    PEN_LIFTED = "swing.pen-lifted"
    TIP_ELSEWHERE = "swing.tip-elsewhere"
    IMAGES_READ = "swing.images-read"
    PAUSED = "swing.paused"
    SOLVING = "swing.solving"
    TOO_FEW_IMAGES = "verdict.too-few-images"
    TOO_LITTLE_TILT = "verdict.too-little-tilt"
    NOT_UPRIGHT = "verdict.not-upright"
    UNKNOWN = "verdict.unknown"
    UNCERTAIN = "verdict.uncertain"
    TWO_STAGE_OFF = "verdict.two-stage-off"
    STEP = "verdict.step"
    HALVES_DIFFER = "verdict.halves-differ"
    MANY_DROPPED = "verdict.many-dropped"
    MANY_EXCLUDED = "verdict.many-excluded"
    CENTRES_REJECTED = "verdict.centres-rejected"
    LED_REJECTED = "verdict.led-rejected"
    LEDS_OFF = "verdict.leds-off"
    LED_DISPLACED = "verdict.led-displaced"
    LEDS_MISFIT = "verdict.leds-misfit"
    CAMERA_TILTS = "verdict.camera-tilts"
    FILE_UNCERTAIN = "verdict.file-uncertain"
    FILE_ASSUMED = "verdict.file-assumed"
    FILE_CONTRADICTED = "verdict.file-contradicted"
    NOT_SIMULTANEOUS = "verdict.not-simultaneous"
    CAMERA_MOVED = "verdict.camera-moved"
    NO_TEMPERATURE = "verdict.no-temperature"
    OUT_OF_REACH = "swing.out-of-reach"
    TIP_CHANGED = "verdict.tip-changed"
    CHANGE_BEYOND_LIMIT = "verdict.change-beyond-limit"
    LAST_UNKNOWN = "verdict.last-unknown"
    NO_TIP = "verdict.no-tip"
    GOOD = "verdict.good"
    GOOD_UNCHECKED = "verdict.good-unchecked"


SHOW_PEN = message(Code.SHOW_PEN)
SEAT_TIP = message(Code.SEAT_TIP)
SWING_TO_SEAT = message(  # no nominal tip: it is found by swinging
    Code.SWING_TO_SEAT
)
HOLD_STILL = message(Code.HOLD_STILL)
HOLD_UPRIGHT = message(Code.HOLD_UPRIGHT)
LEAN_TO_YOUR_RIGHT = message(Code.LEAN_TO_YOUR_RIGHT)
FOLLOW_ARROW = message(Code.FOLLOW_ARROW)
TOO_FAST = message(Code.TOO_FAST)
PEN_LOST = message(Code.PEN_LOST)
PEN_LIFTED = message(Code.PEN_LIFTED)
PAUSED = message(Code.PAUSED)
SOLVING = message(Code.SOLVING)
NO_TEMPERATURE = message(Code.NO_TEMPERATURE)
UNKNOWN = message(Code.UNKNOWN)

# By the directions of the dial, as the camera sees them: against the clock from above.
SIDES = (
    message("side.right"),
    message("side.away-right"),
    message("side.away"),
    message("side.away-left"),
    message("side.left"),
    message("side.towards-left"),
    message("side.towards"),
    message("side.towards-right"),
)
MOST_SIDES = message("side.most")


def too_little_tilt(n_images: int, directions: Iterable[int]) -> Message:
    """Message: missing images by direction of the dial (0 to 7)."""
    sides = tuple(SIDES[direction] for direction in sorted(set(directions)))
    return message(
        Code.TOO_LITTLE_TILT,
        sides=sides if len(sides) <= MANY_SIDES else MOST_SIDES,
        n_images=n_images,
    )


def file_uncertain(
    uncertainty: float, limit: float, share: float, advice: Message, assumed: bool
) -> Message:
    """Message: a file's uncertainty raises U (k = 2) above its limit, mm.

    ``share`` is U by that alone; ``advice`` names it and the remedy, completing
    "from ..."; ``assumed`` is whether the file leaves its uncertainty out.
    """
    if assumed:
        return message(
            Code.FILE_ASSUMED,
            uncertainty=uncertainty,
            limit=limit,
            share=share,
            advice=advice,
        )
    return message(
        Code.FILE_UNCERTAIN,
        uncertainty=uncertainty,
        limit=limit,
        share=share,
        advice=advice,
    )


def time_span(intervals: float, interval_ms: float | None) -> Message:
    """Return a time without its sign, given in image intervals: in µs to s if known."""
    if interval_ms is None:
        return message("time.intervals", value=abs(intervals))
    span_ms = abs(intervals) * interval_ms
    if span_ms < 0.9995:  # rounds to less than 1 ms
        return message("time.us", value=1000 * span_ms)
    if span_ms < 999.5:
        return message("time.ms", value=span_ms)
    return message("time.s", value=span_ms / 1000)


def lateness(intervals: float, interval_ms: float | None) -> Message:
    """Return a delay or advance, given in image intervals, as text."""
    time = time_span(intervals, interval_ms)
    if intervals < 0:
        return message("time.early", time=time)
    return message("time.late", time=time)
