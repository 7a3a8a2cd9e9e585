"""`lightpen stream` tells who listens of the pen in recorded images."""

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import numpy as np
import pytest
from pyigtl import OpenIGTLinkClient

from lightpen.record.calibrations import read_calibration

Run = Callable[..., CompletedProcess[str]]
LONGEST = 60.0  # s until a test gives up


@pytest.fixture
def record(swung: Callable[..., Path], calibration_of: Callable[..., Path]) -> Path:
    """The record of a swing as JSON; only read it."""
    return calibration_of(swung()) / "calibration.json"


@pytest.mark.slow
def test_a_recorded_swing_is_streamed_with_its_tip(
    swung: Callable[..., Path], record: Path
) -> None:
    words = ["stream", swung(), "--tip", record, "--port", "0", "--once"]
    with subprocess.Popen(
        [sys.executable, "-m", "lightpen_program", *map(str, words)],
        stdout=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stdout is not None
        reported = process.stdout.readline()
        place = re.search(r"at 127\.0\.0\.1:(\d+)\.", reported)
        assert place is not None
        client = OpenIGTLinkClient(port=int(place[1]))
        message = client.wait_for_message("TipToCamera", timeout=LONGEST)
        client.stop()

        assert process.wait(LONGEST) == 0
    cone = read_calibration(record).cone_cam
    # In one image the tip is known to some 0.1 mm, and it rests in the cone.
    np.testing.assert_allclose(message.matrix[:3, 3], cone, atol=1.0)
    assert "Covariance" in message.metadata


@pytest.mark.parametrize("lack", ["--camera", "--pen"])
def test_what_does_not_stand_beside_the_images_must_be_given(
    lightpen: Run, scene: Callable[..., Path], tmp_path: Path, lack: str
) -> None:
    images = scene("--images", "3", "--seed", "1") / "images"
    alone = tmp_path / "images"
    alone.mkdir()
    for image in images.iterdir():
        (alone / image.name).write_bytes(image.read_bytes())
    beside = images.parent
    given = {"--camera": beside / "camera.yaml", "--pen": beside / "leds.csv"}
    del given[lack]

    outcome = lightpen("stream", alone, *(w for pair in given.items() for w in pair))

    assert outcome.returncode == 2
    assert f"{lack} FILE is missing" in outcome.stderr


def test_an_address_of_another_computer_is_refused(
    lightpen: Run, swung: Callable[..., Path]
) -> None:
    outcome = lightpen("stream", swung(), "--address", "192.0.2.1", "--port", "0")

    assert outcome.returncode == 2
    assert "192.0.2.1 is not an address of this computer" in outcome.stderr
