"""What a file kept in English is told in the language that is chosen."""

from collections.abc import Iterator

import pytest
from PySide6.QtWidgets import QApplication

from lightpen.errors import FileError
from lightpen.messages import (
    camera_moved,
    file_contradicted,
    file_uncertain,
    halves_differ,
    last_unknown,
    led_displaced,
    tip_changed,
    tip_is_good,
    too_little_tilt,
)
from lightpen.sentences import Sentence, sentence
from lightpen_app.look.languages import Language, LanguageSwitch
from lightpen_app.look.sentences import worded
from lightpen_app.paper.recorded_words import worded_anew

DAMAGED = sentence(
    "results.damaged",
    "The result {file} is damaged. Restore it from a copy, or move it away to "
    "go on without it.",
    file="a, b {c}.json",
)
ADVICE = sentence(
    "share.temperature",
    "the temperature of the pen. State its expansion in the LED file, and measure "
    "its temperature at the swing",
)


@pytest.fixture
def chinese(qapp: QApplication) -> Iterator[None]:
    switch = LanguageSwitch(qapp)
    switch.set_language(Language.CHINESE)
    yield
    switch.remove()


@pytest.mark.usefixtures("chinese")
@pytest.mark.parametrize(
    "told",
    [
        tip_is_good(0.0123),
        tip_changed(0.03, "2026-01-02", "y", 0.02, 0.01),
        halves_differ(0.02, 0.01),
        camera_moved(0.1),
        led_displaced(7, 0.05),
        too_little_tilt(6, [0, 2, 5]),
        too_little_tilt(20, range(8)),
        last_unknown(DAMAGED),
        file_contradicted(DAMAGED),
        file_uncertain(0.02, 0.01, 0.015, ADVICE, assumed=True),
        file_uncertain(0.02, 0.01, 0.015, ADVICE, assumed=False),
    ],
    ids=lambda told: told.code,
)
def test_a_sentence_is_told_as_if_it_had_never_been_written_down(
    told: Sentence,
) -> None:
    assert worded_anew(str(told)) == worded(told)
    assert worded_anew(str(told)) != str(told)


@pytest.mark.usefixtures("chinese")
@pytest.mark.parametrize("text", ["", "Hall 3", "Someone wrote this; no program did."])
def test_other_words_stay_as_they_are(text: str) -> None:
    assert worded_anew(text) == text


def test_in_english_they_are_as_they_were_kept() -> None:
    for told in (tip_is_good(0.0123), last_unknown(FileError(DAMAGED).sentence)):
        assert worded_anew(str(told)) == str(told)
