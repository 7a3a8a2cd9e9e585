"""Snapshot of a swing at one moment."""

import logging
from dataclasses import dataclass, field, replace
from enum import StrEnum
from pathlib import Path
from typing import Protocol, Self

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.causes import UNKNOWN_CAUSE
from lightpen.detection.rig_observations import fit_rig_poses
from lightpen.estimation.contact.single_images import USUAL_SIGMA
from lightpen.estimation.reports.verdict import Verdict
from lightpen.messages import Code, Message, message
from lightpen.model.names import Origin
from lightpen.record.results.acceptance import SwingAssessment
from lightpen.record.results.results import Result
from lightpen.record.swings.header import Names
from lightpen.record.swings.solving import Solution
from lightpen.runners import FaultListener, FaultReporter
from lightpen.swing.capture.kept_images import AcceptedImages
from lightpen.swing.capture.state import (
    Pause,
    Phase,
    SwingEvent,
    SwingSetup,
    SwingState,
)
from lightpen.swing.preparation import Preparation


@dataclass(frozen=True, eq=False)
class FailedSwing:
    """Reason of a failed solution, and the fit of the LEDs in each image alone."""

    causes: tuple[Message, ...]  # the most evident one first
    pixels: FloatArray  # (N, C, L, 2), LED centres, px; NaN where one was not seen
    residuals: FloatArray  # (N, C, L, 2), from the pose of each moment, px


def failed_swing(setup: SwingSetup, kept: AcceptedImages, why: Message) -> FailedSwing:
    """Return a swing that gave no tip.

    Residuals of the poses do not depend on the cone. Where they are above the usual
    ones, a file or an LED is a likelier cause than the seat.
    """
    residuals = np.full_like(kept.pixels, np.nan)
    if len(kept):
        poses = fit_rig_poses(
            setup.rig, setup.pen, kept.pixels, kept.rotations, kept.translations
        )
        residuals = poses.residuals.reshape(kept.pixels.shape)
    sigma = float(np.median(kept.sigmas)) if len(kept) else 0.0
    fits = sigma <= USUAL_SIGMA
    causes = (
        (why,)
        if fits
        else (
            message(
                Code.LEDS_MISFIT, sigma=sigma, usual=USUAL_SIGMA, cause=UNKNOWN_CAUSE
            ),
            why,
        )
    )
    return FailedSwing(causes, kept.pixels, residuals)


_logger = logging.getLogger(__name__)


class Activity(StrEnum):
    """Background activity."""

    NONE = ""
    READING = "reading"  # the images of the swing, to capture more
    SOLVING = "solving"
    ACCEPTING = "accepting"


@dataclass(frozen=True, eq=False)
class SwingStatus:
    """A swing from its first image to the accepted tip."""

    setup: SwingSetup | None = None  # kept when the swing is left
    state: SwingState | None = None  # None while there is no swing
    record_folder: Path | None = None
    names: Names = field(default_factory=Names)
    origin: Origin | None = None
    solution: Solution | None = None  # None until solved
    assessment: SwingAssessment | None = None
    pressed: Solution | None = None  # with firm pressure, for the press test
    failed: FailedSwing | None = None  # None if the images give a tip
    result: Result | None = None  # that was accepted
    revoked: Result | None = None  # that was revoked last, of this swing or another
    activity: Activity = Activity.NONE
    refusal: Message | None = None  # why no swing could begin automatically
    has_fault: bool = False  # paused because an image could not be recorded
    has_other_choices: bool = False  # since it began, while it is open

    @property
    def verdict(self) -> Verdict | None:
        """The verdict on the solution."""
        return None if self.assessment is None else self.assessment.verdict

    @property
    def failure(self) -> FailedSwing | None:
        """Why there is no tip, once its computation has failed."""
        return self.failed if self.has_verdict and self.solution is None else None

    @property
    def has_verdict(self) -> bool:
        """Whether its computation has ended, with a tip or without."""
        return self.state is not None and self.state.phase is Phase.VERDICT

    @property
    def is_capturing(self) -> bool:
        """Whether images are being taken, or wait to be."""
        state = self.state
        return state is not None and state.phase not in (Phase.SOLVING, Phase.VERDICT)

    @property
    def is_recording(self) -> bool:
        """Whether no more images can be captured: all were recorded before."""
        return self.setup is not None and self.setup.is_recording

    @property
    def is_solving(self) -> bool:
        """Whether a solution is being computed."""
        return self.activity is Activity.SOLVING

    @property
    def is_reading(self) -> bool:
        """Whether its images are being read, to capture more."""
        return self.activity is Activity.READING

    @property
    def is_paused_by_user(self) -> bool:
        """Whether it was paused by the user."""
        return self.state is not None and self.state.pause is Pause.BY_USER


class SwingListener(FaultListener, Protocol):
    """Listener, called on runner threads; must return soon."""

    def on_swing(self, status: SwingStatus, events: tuple[SwingEvent, ...]) -> None:
        """Handle a new status and the events."""

    def on_progress(self, fraction: float) -> None:
        """Handle the progress of the solution, 0 to 1."""


def log_change(
    before: SwingStatus, now: SwingStatus, events: tuple[SwingEvent, ...]
) -> None:
    """Log what has changed in a status, and the events."""
    for event in events:
        _logger.debug("event: %s %s", event.what, event.numbers or "")
    if now.record_folder != before.record_folder and now.record_folder is not None:
        _logger.info("swing started or continued: %s", now.record_folder)
    elif now.record_folder is None and before.record_folder is not None:
        _logger.info("swing left: %s", before.record_folder)
    phases = [status.state and status.state.phase for status in (before, now)]
    if phases[0] is not phases[1]:
        _logger.info("phase: %s", phases[1])
    if now.assessment is not None and now.assessment is not before.assessment:
        verdict = now.assessment.verdict
        _logger.info("verdict: %s: %s", verdict.grade, verdict.reason)
    result = now.result
    if result is not None and result is not before.result:
        _logger.info("accepted: tip %s, reason %r", result.names.tip, result.reason)


# Presence of the operator: automatic begin, pause and resumption of swings.


@dataclass(frozen=True, eq=False)
class OperatorPresence:
    """Presence of the operator, and the choices for the next swing.

    Until the operator has come or left, a swing begins and pauses by commands.
    """

    is_here: bool = False  # waits for a swing, which begins when nothing is missing
    is_away: bool = False  # the capture is paused
    paused_by_leaving: bool = False  # for that reason alone: it resumes automatically
    choices: Preparation | None = None
    begun_with: Preparation | None = None  # when the swing began, or confirmed since
    refusal: Message | None = None  # why no swing could begin; until it is cleared

    @property
    def is_due(self) -> bool:
        """Whether a swing begins with the next image."""
        is_wanted = self.is_here and self.refusal is None
        return (
            is_wanted and self.choices is not None and not self.choices.missing_inputs()
        )

    @property
    def has_other_choices(self) -> bool:
        """Return whether the choices differ from those of the current swing."""
        if self.choices is None or self.begun_with is None:
            return False
        return not self.begun_with.swings_like(self.choices)

    def choose(self, choices: Preparation) -> Self:
        """Return a copy with other choices.

        Files that were still being read when a swing was resumed are no change.
        """
        begun = self.begun_with
        if begun is not None:
            begun = replace(
                begun,
                camera_file=begun.camera_file or choices.camera_file,
                pen_file=begun.pen_file or choices.pen_file,
            )
        return replace(self, choices=choices, begun_with=begun)

    def arrived(self) -> Self:
        """Return a copy with the operator present and refusals cleared."""
        return replace(
            self, is_here=True, is_away=False, paused_by_leaving=False, refusal=None
        )

    def left(self) -> Self:
        """Return a copy with the operator absent."""
        return replace(self, is_here=False, is_away=True)

    def begun(self) -> Self:
        """Return a copy with a swing begun with the present choices."""
        return replace(
            self, begun_with=self.choices, paused_by_leaving=False, refusal=None
        )


class PublishedSwing:
    """Holds the status for the parts of the workflow, and notifies."""

    def __init__(self, listener: SwingListener) -> None:
        self._listener = listener
        self.faults = FaultReporter(listener)
        self.status = SwingStatus()
        self.presence = OperatorPresence()

    def publish(self, status: SwingStatus, *events: SwingEvent) -> None:
        """Set the status and notify."""
        is_open = status.is_capturing or (status.has_verdict and not status.result)
        before = self.status
        self.status = replace(
            status,
            refusal=self.presence.refusal,
            has_other_choices=is_open and self.presence.has_other_choices,
        )
        log_change(before, self.status, events)
        self._listener.on_swing(self.status, events)

    def republish(self) -> None:
        """Notify, after the presence has changed."""
        self.publish(self.status)
