"""The scale of the pen by certified lengths.

An error of the pen's scale leaves no residual and moves nothing that stands still; a
length shows it. So lengths, with their covariance, determine the scale.
"""

from collections.abc import Sequence

import numpy as np

from lightpen.comparisons.recorded_tasks import Scale
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen_extensions.measure.measuring.part import MeasuredPart
from lightpen_extensions.measure.measuring.plan import CharacteristicKind
from lightpen_extensions.measure.tasks.probed_point import ProbedPoint


def scale_of(
    part: MeasuredPart, points: Sequence[ProbedPoint], instrument: Instrument
) -> Scale | None:
    """Return the scale from prior and lengths (least squares); None without lengths."""
    lengths = [
        (each.value.value - (each.planned.nominal or 0.0), each.planned.certified, each)
        for each in part.results
        if each.planned.quantity is CharacteristicKind.LENGTH and each.quantity
    ]
    rows = [e.quantity.by_inputs[0] for *_, e in lengths if e.quantity is not None]
    known = np.array([u for _, u, _ in lengths if u is not None])
    if not rows or len(known) < len(rows):
        return None
    errors, by_inputs = np.array([error for error, *_ in lengths]), np.array(rows)
    by_instrument = by_inputs[:, :-1] @ np.concatenate([p.sensitivity for p in points])
    leds = instrument.pen.leds - instrument.pen.leds.mean(axis=0)
    of_scale = np.zeros(len(instrument.covariance))
    of_scale[instrument.parameters.leds] = (leds / np.sum(leds**2)).ravel()
    shared = by_instrument @ instrument.covariance @ of_scale
    spread = by_inputs @ part.touches.inputs @ by_inputs.T
    spread += np.outer(known, known) / COVERAGE_FACTOR**2
    gain = np.linalg.solve(spread, shared)
    before = float(of_scale @ instrument.covariance @ of_scale)
    return Scale(
        factor=1.0 - float(gain @ errors),
        uncertainty=COVERAGE_FACTOR * max(before - float(gain @ shared), 0.0) ** 0.5,
        uncertainty_before=COVERAGE_FACTOR * before**0.5,
    )
