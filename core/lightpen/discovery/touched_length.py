"""Scale of a pen by a certified length whose ends were touched with it."""

from dataclasses import replace

import numpy as np

from lightpen.discovery.found import Discovery
from lightpen.discovery.request import Request
from lightpen.discovery.requirements import contradicting_distance
from lightpen.discovery.scale import CONTRADICTING, SHAPE, MeasuredLength, known_lengths
from lightpen.model.expanded_uncertainty import COVERAGE_FACTOR
from lightpen.verification.tasks.length import LengthOptions, measure_length
from lightpen.verification.tasks.task import Conditions


def with_touched_length(request: Request, relative: Discovery) -> Request:
    """Return a request with the distance of two LEDs by the touched length.

    The touches measure that length in the unit of the relative result. The ratio to the
    certified length is the scale, and so the distance of the LEDs farthest apart.
    Raises `CalibrationError` if the touches are not of two ends, or a known length
    contradicts theirs.
    """
    touched = request.touched
    assert touched is not None
    instrument = relative.calibration.instrument
    runs = [("--touched", touched.touches(instrument))]
    (run,) = measure_length(runs, Conditions(instrument), LengthOptions()).runs
    known, certified = relative.lengths[0], touched.separation
    length = known.length * certified.distance / run.measured
    own = run.uncertainty / COVERAGE_FACTOR / run.measured
    sigma = length * float(np.hypot(own, certified.sigma / certified.distance))
    for each in known_lengths(request.lengths, relative.pen.leds):
        implied = run.measured * each.length / each.between(relative.pen.leds)
        relative_sigma = np.linalg.norm([own, each.sigma / each.length, SHAPE])
        by_chance = np.hypot(implied * relative_sigma, certified.sigma)
        if abs(implied - certified.distance) > CONTRADICTING * by_chance:
            raise contradicting_distance(certified.distance, implied, each)
    measured = MeasuredLength((known.first + 1, known.second + 1), length, sigma)
    return replace(request, lengths=(*request.lengths, measured))
