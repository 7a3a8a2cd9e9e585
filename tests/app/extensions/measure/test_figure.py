"""Tests of what the step Verify shows of touches."""

from lightpen.model.posture import Posture
from lightpen_app_extensions.measure.figure import dial_of


def test_a_field_of_the_dial_is_full_that_was_touched_in() -> None:
    dial = dial_of(
        [Posture(0.0, 0.0, 0.0), Posture(0.25, 0.0, 0.0), Posture(0.25, 0.0, 0.0)], None
    )

    assert (dial.n_fields, dial.n_full) == (2, 2)
    assert dial.n_upright == 1
