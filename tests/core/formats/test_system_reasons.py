"""What the system says of a file is reported in any language, where it is known."""

import errno
import os

from lightpen.formats.files import strerror
from lightpen.messages import Message


def test_a_known_reason_is_worded_as_the_system_does_and_can_be_translated() -> None:
    said = strerror(PermissionError(errno.EACCES, os.strerror(errno.EACCES)))

    assert isinstance(said, Message)
    assert str(said) == "Permission denied"
    assert said.code == "system.denied"


def test_any_other_reason_is_reported_as_the_system_words_it() -> None:
    assert strerror(OSError(errno.EXDEV, "Invalid cross-device link")) == (
        "Invalid cross-device link"
    )
    assert strerror(OSError("no number, no words")) == "OSError"
