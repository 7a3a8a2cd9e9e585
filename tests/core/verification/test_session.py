"""A whole verification by the simulated operator, without a key."""

from dataclasses import replace

import numpy as np

from lightpen.cameras.clock import SkippingClock
from lightpen.cameras.protocol import CameraSettings
from lightpen.detection.sighting import Sighting, look
from lightpen.estimation.instrument import instrument_of_files
from lightpen.simulator.camera import SimulatedCamera
from lightpen.simulator.scenes import Scene
from lightpen.simulator.swings import paper_camera
from lightpen.simulator.toucher import Artefacts, Toucher
from lightpen.verification.session import (
    SessionSetup,
    SessionState,
    advance,
    instruction,
)

LONGEST = 180.0  # s of the operator's time, from the first touch to the verdict
GIVE_UP = 240.0  # s
FRAME_RATE = 10.0  # 1/s: half of the usual one, as each image is rendered


def test_a_simulated_operator_verifies_a_tip_without_a_key() -> None:
    scene = Scene(camera=paper_camera(binning=4))
    pen = replace(scene.pen, led_sigma=0.002)
    instrument = instrument_of_files(
        scene.camera, pen, scene.tip_pen, 1e-6 * np.eye(3), 0.01
    )
    artefacts = Artefacts()
    setup = SessionSetup(
        instrument,
        radius=artefacts.ring_radius,
        length=artefacts.length,
        cone_cam=scene.cone_cam,
        n_touches=6,
        n_frames=3,
    )
    clock = SkippingClock()
    camera = SimulatedCamera(scene, clock)
    camera.open()
    camera.configure(CameraSettings(frame_rate=FRAME_RATE))
    camera.start()
    toucher = Toucher(camera.operator, artefacts)
    state, before, finished, first = SessionState(), None, [], None
    asked = {instruction(setup, state).code}
    while state.task(setup) is not None and clock.now_ns() < GIVE_UP * 1e9:
        toucher.follow(setup, state)
        frame = camera.read(1.0)
        sighting: Sighting = look(frame.image, scene.camera, pen, None, before)
        before = sighting
        transition = advance(setup, state, str(frame.seq), sighting)
        state = transition.state
        asked.add(instruction(setup, state).code)
        if transition.events and first is None:
            first = clock.now_ns()
        if transition.finished is not None:
            finished.append(transition.finished)
    camera.close()

    assert finished == list(setup.tasks)
    assert first is not None
    assert (clock.now_ns() - first) * 1e-9 < LONGEST
    assert state.fixed_point is not None
    assert state.circle is not None
    assert state.length is not None
    # A quarter of the pixels: the noise is four times that of the whole camera.
    assert abs(state.circle.errors[0]) < 0.05
    assert abs(state.length.errors[0]) < 0.05
    assert state.assessment is not None
    assert asked == {
        "session.touch-cone",
        "session.touch-ring",
        "session.touch-ends",
        "session.done",
    }
