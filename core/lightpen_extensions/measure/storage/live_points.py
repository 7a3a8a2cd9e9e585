"""Live images of a verification: kept where they may count, and processed."""

from lightpen.cameras.protocol import Frame
from lightpen.detection.pen_detection import PenDetection
from lightpen.detection.region_of_interest import RegionOfInterest
from lightpen.detection.rig_pose import see_together
from lightpen_extensions.measure.probing.drift_reference import (
    LampDrift,
    LampObservations,
)
from lightpen_extensions.measure.probing.probing import ProbingPhase, approach_of
from lightpen_extensions.measure.session.session import (
    SessionSetup,
    SessionState,
    SessionTransition,
    advance_session,
    with_drift,
)
from lightpen_extensions.measure.storage.session_record import SessionRecord


class LivePoints:
    """Takes the images of one verification after another."""

    def __init__(self) -> None:
        self._lamps = LampObservations()

    def begin(self, lamps: LampObservations) -> None:
        """Begin another verification, with the lamps observed so far."""
        self._lamps = lamps

    def lamp_drift(self, setup: SessionSetup) -> LampDrift | None:
        """Return the drift of fixed lamps."""
        cameras = setup.instrument.rig.cameras
        return self._lamps.lamp_drift(cameras, setup.choices.limits)

    def take(
        self,
        images: SessionRecord,
        setup: SessionSetup,
        state: SessionState,
        frame: Frame,
        detection: PenDetection,
        region: RegionOfInterest,
    ) -> SessionTransition:
        """Process an image and return the transition of the verification.

        An image of a point is put on the disk before it counts.
        """
        touching, rules = state.touching, setup.rules
        is_holding = touching.phase is ProbingPhase.HOLDING
        if is_holding:
            self._lamps = self._lamps.with_frame(frame, detection, region)
        seen = see_together(setup.instrument.rig, setup.instrument.pen, detection)
        name, n_held = str(frame.seq), len(touching.held)
        may_count = is_holding and n_held >= rules.n_settling
        if may_count and seen.has_pose and not seen.is_blurred:
            tip_cam = seen.rotation @ setup.instrument.tip_pen + seen.translation
            name = images.keep(frame, seen, approach_of(touching, tip_cam))
        if n_held + 1 >= rules.n_settling + rules.n_frames:  # a point may end
            setup = with_drift(setup, self.lamp_drift(setup))
        transition = advance_session(setup, state, name, seen)
        images.follow(state, transition)
        return transition
