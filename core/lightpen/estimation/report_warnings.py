"""What the user should look into, whatever the tip of a calibration is worth."""

import numpy as np

from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.lamp_report import lamp_warnings
from lightpen.estimation.linearised import N_CONE
from lightpen.estimation.rig_report import rig_warnings
from lightpen.estimation.seat_forms import FORMS
from lightpen.estimation.single_images import USUAL_SIGMA
from lightpen.sentences import Sentence, sentence


def warnings_of(calibration: Calibration) -> list[Sentence]:
    """Return what the user should look into, one sentence or two each."""
    leds, sigma = calibration.leds, calibration.joint.sigma
    warnings = [
        *rig_warnings(calibration),
        *(each.sentence for each in calibration.contradictions),
        *lamp_warnings(calibration),
        *_seat_warnings(calibration),
    ]
    warnings += [
        sentence(
            "warning.led-unseen",
            "LED {led} was found in no image. A finger may cover it, it may be off, or "
            "its place in the pen file may be wrong.",
            led=int(led) + 1,
        )
        for led in np.flatnonzero(leds.n_seen == 0)
    ]
    warnings += [
        sentence(
            "warning.led-displaced",
            "LED {led} sits {distance:.3f} mm off its place in the pen file. Check the "
            "file, or measure the pen again.",
            led=led,
            distance=float(np.linalg.norm(leds.displacement[led - 1])),
        )
        for led in leds.displaced
    ]
    if sigma > USUAL_SIGMA:
        warnings.append(
            sentence(
                "warning.large-residuals",
                "The residuals are large: {sigma:.2f} px, {usual} px or less is usual. "
                "Check that the camera file is of this camera, lens and focus, and the "
                "pen file of this pen.",
                sigma=sigma,
                usual=USUAL_SIGMA,
            )
        )
    return warnings


def _seat_warnings(calibration: Calibration) -> list[Sentence]:
    """Return what is told of a tip that did not rest where the model has it."""
    bundle, found = calibration.bundle, calibration.bundle.counted
    warnings = []
    jitter = found.jitter.covariance
    # Ball and cone that are as round as assumed move the tip by so much as well.
    by_form = calibration.priors.form_error * float(np.sqrt(N_CONE * sum(FORMS)))
    distance = 0.0 if jitter is None else float(np.sqrt(np.trace(jitter)))
    if distance > by_form:
        warnings.append(
            sentence(
                "warning.seat-jitter",
                "The tip did not come to rest in the same place: it moved by "
                "{distance:.4f} mm (standard deviation) from image to image. Clean tip "
                "and cone, look for wear, and press the tip in. It is in the "
                "uncertainty.",
                distance=distance,
            )
        )
    forms = (*found.seat, found.oval)
    if any(form.is_significant for form in forms):
        warnings.append(
            sentence(
                "warning.seat-form",
                "The tip moved in its seat as the pen leant, by some {distance:.4f} "
                "mm. Tip or cone may be out of round, worn or dirty. It is in the "
                "uncertainty.",
                distance=max(form.sigma for form in forms),
            )
        )
    if found.drift.is_significant:
        warnings.append(
            sentence(
                "warning.drift",
                "The cone moved by {distance:.4f} mm against the camera during the "
                "swing. Clamp both, let the camera warm up, and repeat. It is in the "
                "uncertainty.",
                distance=bundle.drift,
            )
        )
    stated = calibration.priors.led_sigma
    if stated is not None and found.leds.is_significant:
        warnings.append(
            sentence(
                "warning.led-file-contradicted",
                "The images contradict the LED file: its coordinates are off by "
                "{found:.4f} mm (standard deviation), the file states {stated:.4f} mm. "
                "Measure the pen again, or check that the file is of this pen.",
                found=found.leds.sigma,
                stated=stated,
            )
        )
    return warnings
