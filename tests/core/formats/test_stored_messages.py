"""A stored message is worded from its code and values; its text is for people alone."""

import json
import math

import pytest
from msgspec import structs, to_builtins

from lightpen.formats.own_json import DamagedError, StoredMessage, in_shape
from lightpen.messages import Code, Message, file_uncertain, message, too_little_tilt

DAMAGED = message("results.damaged", file="a, b {c}.json")
ADVICE = message("share.leds")


def stored(original: Message) -> StoredMessage:
    """Return a message as it is read back from JSON, without its text."""
    written = json.dumps(to_builtins(StoredMessage.of(original)))
    return structs.replace(in_shape(json.loads(written), StoredMessage), text="")


@pytest.mark.parametrize(
    "original",
    [
        message(
            Code.TIP_CHANGED,
            distance=0.03,
            date="2026-01-02",
            axis="y",
            difference=0.02,
            uncertainty=0.01,
        ),
        message(Code.HALVES_DIFFER, difference=0.02, usual=0.01),
        message(Code.LED_DISPLACED, led=7, distance=0.05),
        too_little_tilt(6, [0, 2, 5]),
        too_little_tilt(20, range(8)),
        message(Code.LAST_UNKNOWN, why=DAMAGED),
        file_uncertain(0.02, 0.01, 0.015, ADVICE, assumed=True),
        message(Code.HALVES_DIFFER, difference=math.nan, usual=0.01),
    ],
    ids=lambda original: original.code,
)
def test_it_is_worded_as_if_it_had_never_been_written_down(original: Message) -> None:
    assert StoredMessage.of(original).text == str(original)
    assert stored(original).worded() == str(original)
    assert stored(original).worded(mark) == original.text(mark) != str(original)


def mark(template: str) -> str:
    """Return a template in another language."""
    return f"<{template}>"


@pytest.mark.parametrize(
    "changes", [{"code": "gone.since"}, {"values": {}}, {"values": {"led": "seven"}}]
)
def test_its_text_stands_where_the_catalogue_does_not_fit_any_more(
    changes: dict[str, object],
) -> None:
    original = StoredMessage.of(message(Code.LED_DISPLACED, led=7, distance=0.05))

    assert structs.replace(original, **changes).worded(mark) == original.text


@pytest.mark.parametrize("entries", [{"code": "x", "text": "y"}, {"values": [[]]}])
def test_what_is_no_message_is_refused(entries: dict[str, object]) -> None:
    with pytest.raises(DamagedError):
        in_shape(entries, StoredMessage)
