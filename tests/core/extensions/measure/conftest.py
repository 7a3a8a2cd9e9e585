"""Touches of the simulated pen, made without an image."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.accepted_tip import accept_tip
from tests.simulated_centers import simulate_centers
from tests.verifying import TIMEOUT, Verifier

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.model.rigid import rig_of, rotations_of
from lightpen.swing.preparation import Preparation
from lightpen_extensions.measure.probing.instruments import instrument_of_files
from lightpen_extensions.measure.tasks.probed_point import (
    ProbedPoint,
    ProbingFrame,
    StillFrames,
    measure_touches,
)
from lightpen_extensions.simulator.swings import PAPER_TIP, paper_camera, paper_pen

SIGMA = 0.01  # px
TIP_SIGMA = 0.001  # mm

Touching = Callable[..., tuple[ProbedPoint, ...]]


@pytest.fixture(scope="session")
def instrument() -> Instrument:
    """The paper's camera and pen with files that are as they should be."""
    pen = replace(paper_pen(), led_sigma=0.002)
    return instrument_of_files(
        rig_of(paper_camera()), pen, PAPER_TIP, TIP_SIGMA**2 * np.eye(3), SIGMA
    )


@pytest.fixture(scope="session")
def touching(instrument: Instrument) -> Touching:
    """Return a function that touches points (N, 3), each in a posture of its own."""

    def touched(
        points: FloatArray,
        *,
        seed: int = 1,
        n_frames: int = 1,
        tip_pen: FloatArray = PAPER_TIP,
        tilt: float = 0.3,
    ) -> tuple[ProbedPoint, ...]:
        rng = np.random.default_rng(seed)
        n = len(points)
        directions = np.linspace(0, 2 * np.pi, n, endpoint=False)
        rotations = rotations_of(
            instrument.pen, np.full(n, tilt), directions, rng.uniform(-0.2, 0.2, n)
        )
        held = []
        for i, (point, R) in enumerate(zip(points, rotations, strict=True)):
            t = point - R @ tip_pen
            poses = np.tile(R, (n_frames, 1, 1)), np.tile(t, (n_frames, 1))
            pixels = simulate_centers(
                instrument.camera, instrument.pen, *poses, SIGMA, rng
            )
            held.append(
                StillFrames(
                    tuple(
                        ProbingFrame(f"touch {i + 1} image {k + 1}", each[None], R, t)
                        for k, each in enumerate(pixels)
                    )
                )
            )
        return measure_touches(instrument, held)

    return touched


@pytest.fixture(scope="session")
def ring() -> Callable[..., FloatArray]:
    """Return a function that gives points on a ring that leans to the camera."""

    def points(n: int = 20, radius: float = 31.751, degrees: float = 360) -> FloatArray:
        angles = np.radians(np.linspace(0, degrees, n, endpoint=degrees < 360))
        if degrees >= 360:
            angles = np.radians(np.linspace(0, 360, n, endpoint=False))
        axes = np.array([[1, 0, 0], [0, np.cos(0.4), np.sin(0.4)]])
        spokes = np.column_stack([np.cos(angles), np.sin(angles)]) @ axes
        return np.asarray(np.array([-8.0, 168.0, 1050.0]) + radius * spokes)

    return points


@pytest.fixture
def verifier(tmp_path: Path, prepared: Preparation) -> Iterator[Verifier]:
    verifier = Verifier(tmp_path, prepared)
    yield verifier
    verifier.runner.shut_down()
    assert verifier.runner.await_end(TIMEOUT)


@pytest.fixture
def at_it(verifier: Verifier) -> Verifier:
    """A tip is in force, and somebody is there to verify it."""
    accept_tip(verifier.folder, verifier.preparation)
    verifier.come()
    return verifier
