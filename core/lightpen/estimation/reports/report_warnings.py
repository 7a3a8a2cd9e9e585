"""Warnings of a calibration, independent of its verdict."""

from collections import Counter
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from lightpen.arrays import FloatArray, IntArray
from lightpen.detection.reasons import Reason
from lightpen.detection.small_spots import LARGEST_RADIUS
from lightpen.estimation.bundle.image_fields import MODE_COUNTS
from lightpen.estimation.bundle.linearised import N_CONE
from lightpen.estimation.bundle.priors import SMALL_DOME_DEPTH, modelled_areas
from lightpen.estimation.calibrate import Calibration
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.uncertainty.budget import (
    Budget,
    ContributionName,
    UncertaintyContribution,
)
from lightpen.messages import Code, Message, lateness, message
from lightpen.model.names import Method
from lightpen.model.rigid import of_camera

SEAT_LEDS = 6  # in the usual image, that show how the tip sits
NOISY = 2.5  # times the noise of the usual LED


def lamp_warnings(calibration: Calibration) -> list[Message]:
    """Return warnings on fixed lamps that moved in the images."""
    rig, warnings = calibration.bundle.state.rig, []
    for c, images in enumerate(calibration.cameras):
        path = images.path
        if path is None or path.moved == 0:
            continue
        if path.is_followed:
            warning = message("warning.camera-moved", shift=path.moved)
        else:
            x, y = path.lamps[0]
            warning = message("warning.lamp-moved", x=x, y=y, shift=path.moved)
        warnings.append(of_camera(rig.names[c], warning) if rig.names else warning)
    return warnings


def warnings_of(calibration: Calibration) -> list[Message]:
    """Return all warnings, one or two sentences each."""
    leds, sigma = calibration.leds, calibration.bundle.sigma
    warnings = [
        *_rig_warnings(calibration),
        *(each.message for each in calibration.contradictions),
        *lamp_warnings(calibration),
        *_seat_warnings(calibration),
        *(each.message for each in calibration.fields),
        *_copy_warnings(calibration),
        *([message("warning.own-images")] if calibration.shares_images else []),
        *_noise_warnings(calibration),
        *_self_check_warnings(calibration),
        *_face_warnings(calibration),
    ]
    warnings += [
        message("warning.led-unseen", led=int(led) + 1)
        for led in np.flatnonzero(leds.n_seen == 0)
    ]
    warnings += [
        message(
            "warning.led-displaced",
            led=led,
            distance=float(np.linalg.norm(leds.displacement[led - 1])),
        )
        for led in leds.displaced
    ]
    if sigma > USUAL_SIGMA:
        warnings.append(
            message("warning.large-residuals", sigma=sigma, usual=USUAL_SIGMA)
        )
    return warnings


def _copy_warnings(calibration: Calibration) -> list[Message]:
    n_copies = calibration.reasons.count(Reason.COPY)
    if not n_copies:
        return []
    n_images = len(calibration.reasons)
    return [message("warning.copies", n_copies=n_copies, n_images=n_images)]


def _noise_warnings(calibration: Calibration) -> list[Message]:
    """Return the warnings on LEDs that are far noisier than the others."""
    bundle = calibration.bundle
    noise = np.median(bundle.unknowns.noise, axis=0).max(axis=0)
    return [
        message(
            "warning.led-noise",
            led=int(led) + 1,
            sigma=float(noise[led] * bundle.sigma),
            usual=bundle.sigma,
        )
        for led in np.flatnonzero(noise > NOISY)
    ]


def _self_check_warnings(calibration: Calibration) -> list[Message]:
    check = calibration.self_check
    if check is None or check.is_passed:
        return []
    return [message("warning.self-check", value=check.value, limit=check.limit)]


def _face_warnings(calibration: Calibration) -> list[Message]:
    """Return a warning on LEDs whose faces the images do not show."""
    seen = [each.observations for each in calibration.cameras]
    n_images = np.isfinite([each.edge_widths for each in seen]).sum()
    if calibration.stated.reading is not None or n_images == 0:
        return []
    bundle = calibration.bundle
    areas = modelled_areas(bundle.state, 0)[bundle.used[:, 0]]
    width = 2 * float(np.sqrt(np.median(areas) / np.pi))
    if width > 2 * LARGEST_RADIUS:
        has_areas = np.isfinite([each.areas for each in seen]).sum() >= n_images
        return [] if has_areas else [message("warning.clipped-leds")]
    depth = SMALL_DOME_DEPTH * bundle.unknowns.start.pen.diameter
    return [message("warning.small-leds", width=width, depth=depth)]


def _seat_warnings(calibration: Calibration) -> list[Message]:
    """Return warnings on a seat that deviates from the model."""
    bundle, found = calibration.bundle, calibration.bundle.budget_components
    warnings = []
    jitter = found.jitter.covariance
    # Ball and cone within the assumed form error move the tip as much.
    by_form = calibration.priors.form_error * float(np.sqrt(N_CONE * sum(MODE_COUNTS)))
    distance = 0.0 if jitter is None else float(np.sqrt(np.trace(jitter)))
    n_leds = np.median(bundle.used.sum(axis=(1, 2)))  # fewer hardly tell it from LEDs
    if distance > by_form and n_leds >= SEAT_LEDS:
        warnings.append(message("warning.seat-jitter", distance=distance))
    if any(form.is_significant for form in found.seat):
        largest = max(form.sigma for form in found.seat)
        warnings.append(message("warning.seat-form", distance=largest))
    if found.drift.is_significant:
        warnings.append(message("warning.drift", distance=bundle.drift))
    stated = calibration.priors.led_sigma
    if stated is not None and found.leds.is_significant:
        warnings.append(
            message(
                "warning.led-file-contradicted", found=found.leds.sigma, stated=stated
            )
        )
    return warnings


def late_cameras(calibration: Calibration) -> list[Message]:
    """Return warnings on cameras with a time lag."""
    names = calibration.bundle.state.rig.names[1:]
    interval_ms = calibration.observations.interval_ms
    return [
        message(
            Code.NOT_SIMULTANEOUS, camera=name, lag=lateness(lag.value, interval_ms)
        )
        for name, lag in zip(names, calibration.lags, strict=True)
        if lag is not None and lag.is_noticeable
    ]


def _rig_warnings(calibration: Calibration) -> list[Message]:
    """Return the warnings for several cameras."""
    rig = calibration.bundle.state.rig
    warnings = late_cameras(calibration)
    if rig.n_cameras == 1:
        return warnings
    n_moments = len(calibration.reasons)
    names = np.array([images.observations.names for images in calibration.cameras])
    for c, images in enumerate(calibration.cameras):
        absent = np.array([why is Reason.ABSENT for why in images.reasons])
        if absent.any():
            others = names[:, absent][:, 0]
            warnings.append(
                message(
                    "warning.no-partner",
                    camera=rig.names[c],
                    n_absent=int(absent.sum()),
                    n_moments=n_moments,
                    example=str(next(name for name in others if name)),
                )
            )
        n_apart = images.reasons.count(Reason.OTHER_MOMENT)
        if n_apart:
            first = images.reasons.index(Reason.OTHER_MOMENT)
            warnings.append(
                message(
                    "warning.other-moment",
                    camera=rig.names[c],
                    n_apart=n_apart,
                    n_moments=n_moments,
                    example=images.observations.names[first],
                )
            )
    return warnings


def count_dropped(reasons: tuple[Reason, ...]) -> Counter[Reason]:
    """Return the number of excluded images by reason."""
    return Counter(why for why in reasons if why and why is not Reason.ABSENT)


MOST = 0.5  # of the rejected centres, of one LED or part of the image; of an LED's own
NEARLY_ALL = 0.8  # of the rejected centres, of a few LEDs
FEW = 1 / 3  # of the LEDs
RARE = 0.1  # of the images: an LED seen in fewer is not judged
PARTS = (
    message("rejected.upper-left"),
    message("rejected.upper-right"),
    message("rejected.lower-left"),
    message("rejected.lower-right"),
)


class RejectedCentres(NamedTuple):
    """Centres of the used images that the fit rejects."""

    n_seen: int
    n_rejected: int
    where: Message
    worst_led: int  # its number
    worst_share: float  # of its own centres that are rejected

    @property
    def share(self) -> float:
        """Share of the centres that are rejected."""
        return self.n_rejected / max(self.n_seen, 1)


def rejected_centres(calibration: Calibration) -> RejectedCentres:
    """Count the rejected centres of the used images of all cameras."""
    seen, rejected, parts = [], [], []
    for images in calibration.cameras:
        pixels = images.observations.pixels[images.used]
        is_seen = np.isfinite(pixels[..., 0])
        seen.append(is_seen)
        rejected.append(is_seen & ~images.leds_used[images.used])
        low, high = np.nanmin(pixels, axis=(0, 1)), np.nanmax(pixels, axis=(0, 1))
        right, lower = np.moveaxis(pixels > (low + high) / 2, -1, 0)
        parts.append(right + 2 * lower)
    out, all_seen = np.concatenate(rejected), np.concatenate(seen)
    of_led, seen_of_led = out.sum(axis=0), all_seen.sum(axis=0)
    of_part = np.bincount(np.concatenate(parts)[out], minlength=len(PARTS))
    shares = np.where(seen_of_led > RARE * len(out), of_led / seen_of_led.clip(1), 0.0)
    worst = int(np.argmax(shares))
    return RejectedCentres(
        *(int(all_seen.sum()), int(out.sum()), _where(of_led, of_part)),
        *(worst + 1, float(shares[worst])),
    )


def _where(of_led: IntArray, of_part: IntArray) -> Message:
    """Return where the rejected centres are, by their numbers of LEDs and quarters."""
    n = int(of_led.sum())
    order = np.argsort(-of_led, kind="stable")
    n_few = 1 + int(np.argmax(np.cumsum(of_led[order]) >= NEARLY_ALL * n))
    part = int(np.argmax(of_part))
    if n and 1 < n_few <= FEW * len(of_led):
        few = np.sort(order[:n_few]) + 1
        return message("rejected.leds", leds=", ".join(map(str, few)))
    if n and of_led[order[0]] > MOST * n:
        return message("rejected.led", led=int(order[0]) + 1)
    if n and of_part[part] > MOST * n:
        return PARTS[part]
    return message("rejected.everywhere")


@dataclass(frozen=True, eq=False)
class MethodResult:
    """Tip and cone by one of the methods."""

    tip_pen: FloatArray  # (3,), mm
    cone_cam: FloatArray  # (3,), mm
    budget: Budget  # of both, systematic errors included
    # (N, 3), of the tip of each used image from the cone point, mm
    deviations: FloatArray

    @property
    def rms_mm(self) -> float:
        """Root mean square length of the deviations, mm."""
        return float(np.sqrt(np.mean(np.sum(self.deviations**2, axis=1))))

    @property
    def covariance(self) -> FloatArray:
        """Combined covariance of (tip_pen, cone_cam), (6, 6), mm^2."""
        return self.budget.covariance

    @property
    def expanded_uncertainty(self) -> FloatArray:
        """U (k = 2) of tip and cone, (6,), mm."""
        return self.budget.expanded_uncertainty


def reported(calibration: Calibration) -> MethodResult:
    """Return tip and cone by the method that the calibration reports."""
    return result_of(calibration, calibration.method)


def result_of(calibration: Calibration, method: Method) -> MethodResult:
    """Return tip and cone by one of the methods.

    The two-stage result is uncertain by its difference from the joint fit, which
    contains the projection bias of the discs, and by U of the joint fit: equation (22)
    of method.md.
    """
    joint, budget = calibration.joint, calibration.budget
    if method == "two-stage":
        fit, off = calibration.two_stage, two_stage_difference(calibration)
        share = UncertaintyContribution(ContributionName.METHOD, np.outer(off, off))
        budget = replace(budget, shares=(*budget.shares, share))
        return MethodResult(fit.tip_pen, fit.cone_cam, budget, fit.residuals)
    tips_cam = calibration.tips_cam[calibration.used]
    return MethodResult(
        joint.tip_pen, joint.cone_cam, budget, tips_cam - joint.cone_cam
    )


def two_stage_difference(calibration: Calibration) -> FloatArray:
    """Return tip and cone, two-stage less joint, (6,), mm."""
    joint, fit = calibration.joint, calibration.two_stage
    return np.concatenate([fit.tip_pen - joint.tip_pen, fit.cone_cam - joint.cone_cam])
