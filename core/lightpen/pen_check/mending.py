"""The draft of a pen, mended as its frame or live images show that it should be."""

from collections.abc import Sequence
from typing import cast

from lightpen.pen_check.draft import COLUMNS, PenDraft, check_draft
from lightpen.pen_check.frame import FrameCheck
from lightpen.pen_check.match import Finding, What

MEASURED_DECIMALS = 3  # mm; live images do not tell an LED's place any finer


def leds_to_exchange(frame: FrameCheck | None) -> tuple[int, int] | None:
    """Return the numbers of two LEDs, each of which stands where the other belongs."""
    error = None if frame is None else frame.error
    if error is None or error.code != "pen.leds-exchanged":
        return None
    return cast(int, error.values["first"]), cast(int, error.values["second"])


def exchanged(
    draft: PenDraft, leds: Sequence[int], columns: Sequence[str] = COLUMNS
) -> PenDraft:
    """Return a draft in which two LEDs, by number, have of each other these columns."""
    one, other = (led - 1 for led in leds)
    result = draft
    for column in map(COLUMNS.index, columns):
        result = result.with_cell(one, column, draft.rows[other][column])
        result = result.with_cell(other, column, draft.rows[one][column])
    return result


def mended(draft: PenDraft, finding: Finding) -> PenDraft:
    """Return a draft without what live images show to be wrong with it.

    Coordinates that two LEDs have of each other are exchanged, and an LED off its place
    is put where the images show it. Where either of two coordinates can be exchanged,
    that is chosen which leaves the LEDs in the pen frame.

    Parameters
    ----------
    draft : PenDraft
        Of the pen that was compared, in the same frame.
    finding : Finding
        One that `can_be_mended`.
    """
    if finding.what is not What.EXCHANGED:
        return _put_in_place(draft, finding)
    drafts = [
        exchanged(draft, finding.leds, either.split(", "))
        for either in finding.axes.split("/")
    ]
    fit = (each for each in drafts if check_draft(each).usable is not None)
    return next(fit, drafts[0])


def _put_in_place(draft: PenDraft, finding: Finding) -> PenDraft:
    row = finding.leds[0] - 1
    place = draft.pen().leds[row] + finding.by
    for column, value in enumerate(place.tolist()):
        if round(finding.by[column], MEASURED_DECIMALS):
            draft = draft.with_cell(row, column, f"{value:.{MEASURED_DECIMALS}f}")
    return draft
