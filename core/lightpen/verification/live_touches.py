"""Live images of touches: kept as they are taken, and looked at for fixed lamps."""

from lightpen.cameras.protocol import Frame
from lightpen.detection.aim import Aim
from lightpen.detection.rig_pose import see_together
from lightpen.detection.sighting import Sighting
from lightpen.verification.session import SessionTransition, advance_session, rules_of
from lightpen.verification.session_state import SessionSetup, SessionState, with_drift
from lightpen.verification.touch_images import TouchImages, is_held_on
from lightpen.verification.touching import TouchPhase
from lightpen.verification.witness import LampWatch, LampWitness


class LiveTouches:
    """Takes the images of one verification after another.

    Parameters
    ----------
    images : TouchImages
        Keeps those that count.
    """

    def __init__(self, images: TouchImages) -> None:
        self._images = images
        self._lamps = LampWatch()

    def begin(self, lamps: LampWatch) -> None:
        """Begin another verification, in which lamps were seen so far as told."""
        self._lamps = lamps

    def witness(self, setup: SessionSetup) -> LampWitness | None:
        """Return what lamps tell of the camera."""
        cameras = setup.instrument.rig.cameras
        return self._lamps.witness(cameras, setup.choices.limits)

    def take(
        self,
        setup: SessionSetup,
        state: SessionState,
        frame: Frame,
        sighting: Sighting,
        aim: Aim,
    ) -> SessionTransition:
        """Take an image, and return what becomes of a verification by it.

        Raises
        ------
        FileError
            It counts and cannot be kept.
        """
        if state.touching.phase is TouchPhase.HOLDING:
            self._lamps = self._lamps.with_frame(frame, sighting, aim)
        together = see_together(setup.instrument.rig, setup.instrument.pen, sighting)
        name = self._name(frame, together, setup, state)
        transition = advance_session(self._drifted(setup, state), state, name, together)
        self._images.follow(state, transition)
        return transition

    def _drifted(self, setup: SessionSetup, state: SessionState) -> SessionSetup:
        """Return it with how far the camera has moved, where that is asked for next."""
        task = state.task(setup)
        if task is None:
            return setup
        rules = rules_of(setup, task)
        if len(state.touching.held) + 1 < rules.n_settling + rules.n_frames:
            return setup
        return with_drift(setup, self.witness(setup))

    def _name(
        self, frame: Frame, seen: Sighting, setup: SessionSetup, state: SessionState
    ) -> str:
        """Return the name of an image; one of a touch is kept under it."""
        task = state.task(setup)
        if task is None or not seen.has_pose or seen.is_blurred:
            return str(frame.seq)
        if not is_held_on(rules_of(setup, task), state):
            return str(frame.seq)
        return self._images.keep(frame, seen, task)
