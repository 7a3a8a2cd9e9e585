"""A whole verification by the simulated operator, timed by its own clock."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from tests.simulated_centers import simulate_centers

from lightpen.detection.observations import observe_centers
from lightpen.detection.pen_detection import detect_pen
from lightpen.estimation.calibrate import calibrate
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen.model.artefacts import Artefact, ArtefactKind
from lightpen_extensions.measure.measuring.plan import artefact_plan
from lightpen_extensions.measure.probing_operator import ProbingOperator
from lightpen_extensions.measure.session import (
    SessionSetup,
    SessionState,
    advance_session,
)
from lightpen_extensions.measure.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.task import Conditions, VerificationChoices
from lightpen_extensions.simulator.camera import SimulatedCamera, SkippingClock
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import swing_poses

N_IMAGES = 60  # of the swing that the tip is by
SIGMA = 0.03  # px
LED_SIGMA = 0.002  # mm
GIVE_UP = 300.0  # s


@dataclass(frozen=True, eq=False)
class Verified:
    """A verification, and how long it took.

    Attributes
    ----------
    seconds : float
        Of the operator's time, from the first touch to the verdict.
    """

    seconds: float
    is_done: bool
    is_accepted: bool


def verified(seed: int = 1) -> Verified:
    """Verify a tip by fixed point, ring and length; nothing but the hand is moved."""
    scene = Scene(seed=seed)
    ring = Artefact(ArtefactKind.RING, 31.75, 0.001)
    bar = Artefact(ArtefactKind.LENGTH, 150.0, 0.001)
    plan = artefact_plan("Ring and bar", [ring, bar])
    instrument = _instrument(scene, np.random.default_rng(seed))
    clock = SkippingClock()
    camera = SimulatedCamera(scene, clock)
    camera.open()
    camera.start()
    probing_operator, first, before, found = (
        ProbingOperator(camera.operator),
        0,
        None,
        [],
    )
    for task in (FIXED_POINT, PART):
        choices = VerificationChoices(task.kind, plan)
        setup = SessionSetup(Conditions(instrument), choices)
        state = SessionState()
        while state.done is None and clock.now_ns() < GIVE_UP * 1e9:
            probing_operator.follow(setup, state)
            frame = camera.read(1.0)
            before = detect_pen(
                frame.image, instrument.camera, instrument.pen, None, before
            )
            transition = advance_session(setup, state, str(frame.seq), before)
            state = transition.state
            if transition.recorded and not first:
                first = clock.now_ns()
        found.append(state.found)
    camera.close()
    return Verified(
        (clock.now_ns() - first) * 1e-9,
        is_done=all(found),
        is_accepted=all(each and each.assessment.is_accepted for each in found),
    )


def _instrument(scene: Scene, rng: np.random.Generator) -> Instrument:
    """Return what a swing leaves to measure with."""
    camera, pen = scene.camera, replace(scene.pen, led_sigma=LED_SIGMA)
    swing = swing_poses(N_IMAGES, rng, pen=pen, camera=camera)
    poses = swing.rotations, swing.translations
    pixels = simulate_centers(camera, pen, *poses, SIGMA, rng)
    centers = Centers(np.arange(1, N_IMAGES + 1), pixels, Path("simulated.csv"))
    return calibrate(camera, pen, observe_centers(centers, camera, pen)).instrument
