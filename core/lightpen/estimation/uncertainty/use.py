"""An instrument as it measures: what acts on it then, and did not in its swing.

The effective tip is the point in the scale of the LED file that a swing determines,
with the bending of the swing. When the tip measures, scale and temperature let the pen
grow about its tip, and each touch bends the stylus in a way of its own.
"""

from dataclasses import replace

import numpy as np

from lightpen.estimation.bundle.priors import Prior, temperature_prior, thermal_growth
from lightpen.estimation.uncertainty.instrument import (
    Instrument,
    scale_direction,
    with_bending,
)
from lightpen.messages import Message, message
from lightpen.model.assumptions import Assumptions
from lightpen.model.bending import ASSUMED_BENDING, Bending
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.model.pen import Pen, grown

METRE = 1000.0  # mm


def in_use(
    instrument: Instrument,
    pen: Pen,
    assumptions: Assumptions,
    bending: Bending = ASSUMED_BENDING,
) -> Instrument:
    """Return an instrument as it measures, with what acts on it then.

    Let s be the scale of the pen in the swing. Of it the LED file keeps
    `PenScale.lasting`; the rest was temperature, and that of the measurement takes its
    place. The bending of a touch is independent of that in the swing, which moved the
    effective tip along the pen.

    Parameters
    ----------
    pen : Pen
        As in the LED file.
    assumptions : Assumptions
        With the temperature of the pen while it measures, if it is known.
    """
    scale = instrument.scale
    lasting, lost = scale.lasting, 1 - scale.lasting
    by_scale = scale_direction(instrument)
    temperature = temperature_prior(pen, assumptions)
    # Of the LED file, given s; and of the temperature.
    fresh = lost * scale.file_sigma**2 + temperature.sigma**2
    crossed = np.outer(by_scale, scale.covariance)
    covariance = instrument.covariance - lost * (crossed + crossed.T)
    covariance += (lost**2 * scale.variance + fresh) * np.outer(by_scale, by_scale)
    scale_sigma = float(np.sqrt(lasting**2 * scale.variance + fresh))
    growth = (1 + thermal_growth(pen, assumptions)) * (1 + lasting * scale.deviation)
    change = growth / (1 + scale.growth) - 1
    grown_one = replace(
        instrument,
        pen=grown(instrument.pen, change, instrument.tip_pen),
        covariance=covariance,
        remarks=(_scale_words(scale_sigma, temperature), bending.words),
    )
    return with_bending(grown_one, bending.sigma)


def _scale_words(sigma: float, temperature: Prior) -> Message:
    """Return what the scale adds to a length, and what would make it less."""
    added = COVERAGE_FACTOR * METRE * sigma
    if temperature.assumed:
        return message("use.temperature-assumed", added=added)
    return message("use.scale", added=added)
