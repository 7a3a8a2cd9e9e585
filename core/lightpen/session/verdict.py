"""The verdict on a calibration: good, to be looked at, or to be repeated, and why."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from lightpen.calibrate import USUAL_SIGMA, Calibration
from lightpen.session.messages import Code, Message
from lightpen.session.swing_state import SwingLimits, dial_counts

FAR_OFF = 3.0  # times the limit of U: no result to work with
MANY_DROPPED = 0.2  # of the images
HALVES_GATE = 1.5  # times U (k = 2) of their difference: 3 standard deviations


class Grade(StrEnum):
    """What to do with a calibration."""

    PASS = "pass"
    CHECK = "check"
    REPEAT = "repeat"


@dataclass(frozen=True)
class Verdict:
    """A grade, and the reason that counts most.

    Attributes
    ----------
    grade : Grade
    reason : Message
    """

    grade: Grade
    reason: Message


def judge(calibration: Calibration, limits: SwingLimits) -> Verdict:
    """Judge a calibration by what its tip is worth, not by its residuals alone."""
    uncertainty = calibration.budget.weakest_uncertainty
    limit = limits.max_uncertainty
    uncertain = Message(Code.UNCERTAIN, (uncertainty, limit, 0))
    if uncertainty > FAR_OFF * limit:
        return Verdict(Grade.REPEAT, uncertain)
    halves = calibration.halves
    shares = np.abs(halves.difference) / halves.expanded_uncertainty
    worst = int(np.argmax(shares))
    if shares[worst] > HALVES_GATE:
        figures = (halves.difference[worst], halves.expanded_uncertainty[worst])
        differ = Message(Code.HALVES_DIFFER, tuple(map(float, figures)))
        return Verdict(Grade.CHECK, differ)
    if calibration.joint.sigma > USUAL_SIGMA:
        figures = (calibration.joint.sigma, USUAL_SIGMA)
        return Verdict(Grade.CHECK, Message(Code.LEDS_MISFIT, figures))
    n_images, n_used = len(calibration.used), int(calibration.used.sum())
    if n_images - n_used > MANY_DROPPED * n_images:
        dropped = Message(Code.MANY_DROPPED, (n_images - n_used, n_images))
        return Verdict(Grade.CHECK, dropped)
    if uncertainty > limit:
        return Verdict(Grade.CHECK, uncertain)
    bare = np.flatnonzero(dial_counts(calibration.joint.rotations)[1:].sum(axis=0) == 0)
    if len(bare):
        n_images = limits.min_per_field * len(bare)
        little = Message(Code.TOO_LITTLE_TILT, (n_images, *map(int, bare)))
        return Verdict(Grade.CHECK, little)
    return Verdict(Grade.PASS, Message(Code.GOOD, (uncertainty,)))
