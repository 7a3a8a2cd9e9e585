"""Images of a solved swing for the review, the worst first."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from lightpen.detection.reasons import Reason
from lightpen.record.swings.solving import Solution


@dataclass(frozen=True)
class ImageRow:
    """One image of a solved swing."""

    number: int  # number in the record
    misfit: float  # rms residual with the tip in the cone, px; NaN without the pen
    n_leds: int  # LEDs that were seen, by all cameras together
    reason: Reason  # for not using it; `Reason.NONE` for a used one
    can_be_included: bool  # excluded by the user, or as slipped

    @property
    def is_used(self) -> bool:
        """Whether it takes part."""
        return self.reason is Reason.NONE


def worst_first(solution: Solution) -> tuple[ImageRow, ...]:
    """Return all images of a solved swing by residual; images without a pen first.

    An image keeps its place when excluded or included, but for what that changes
    of the fit.
    """
    misfits = solution.misfits
    seen = (solution.observations, *solution.others)
    n_leds = sum(np.isfinite(each.seen_pixels[..., 0]).sum(axis=1) for each in seen)
    order = np.argsort(-np.nan_to_num(misfits, nan=np.inf), kind="stable")
    return tuple(
        ImageRow(
            number=int(solution.numbers[i]),
            misfit=float(misfits[i]),
            n_leds=int(n_leds[i]),
            reason=solution.calibration.reasons[i],
            can_be_included=int(solution.numbers[i]) in solution.excluded,
        )
        for i in order.tolist()
    )


def count_left_out(solution: Solution) -> Mapping[Reason, int]:
    """Return the number of excluded images by reason, the most frequent first."""
    counts = Counter(reason for reason in solution.calibration.reasons if reason)
    return dict(counts.most_common())
