"""A whole calibration with images that come over GigE Vision, to the accepted tip."""

import shutil
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from tests.gige_simulator import ADDRESS, GigeSimulator
from typing_extensions import override

from lightpen.arrays import Image
from lightpen.cameras.pairing import MachineClock
from lightpen.cameras.protocol import CameraSettings, Region
from lightpen.live.sources import SourceEnvironment
from lightpen.model.limits import SwingLimits
from lightpen.model.names import Origin
from lightpen.record.swings.header import Names
from lightpen.record.swings.reading import open_record
from lightpen.swing.preparation import SourceChoice
from lightpen_app.look.words import on_one_line
from lightpen_app.work.settings import FilePaths, Settings, Station, StoredCamera
from lightpen_extensions.simulator.camera import GuidedOperator, SimulatedCamera
from lightpen_extensions.simulator.scene_files import write_sample_files
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.simulator import SceneSimulator

if TYPE_CHECKING:
    from tests.app.conftest import OpenWizard

SPEED = 4  # times as fast as a clock on the wall
FRAME_RATE = 40.0


class QuickClock(MachineClock):
    """The machine's clock, running fast."""

    is_real = True

    @override
    def now_ns(self) -> int:
        return SPEED * time.monotonic_ns()


@pytest.mark.slow
def test_a_calibration_over_gige_vision_ends_in_an_accepted_tip(
    gige: GigeSimulator,
    small_scene: Scene,
    settings: Settings,
    open_wizard: "OpenWizard",
    tmp_path: Path,
) -> None:
    scene, clock = small_scene, QuickClock()
    rendered = SimulatedCamera(scene, clock)
    rendered.open()
    rendered.configure(CameraSettings(frame_rate=200.0))
    rendered.start()

    def seen(exposure_us: float, gain: int) -> Image:
        rendered.set_exposure(exposure_us)
        return rendered.read(1.0).image

    gige.serve(seen)
    files = write_sample_files(scene, tmp_path / "files")
    measured = tmp_path / "measured"  # as for a real pen, without the simulator's mark
    measured.mkdir()
    camera_file = shutil.copy(files.camera, measured)
    pen_file = shutil.copy(files.pen, measured)
    region = Region(0, 0, *scene.camera.image_size)
    settings.set_camera(
        "LP01", CameraSettings(1000.0, None, FRAME_RATE, "Mono8", region, None, 16_000)
    )
    settings.set_station(
        "Hall 2",
        Station(
            Names("", "Ann", "LP-04", "T-10", "C-1", 10.0),
            camera=StoredCamera(SourceChoice("aravis", ADDRESS)),
            files=FilePaths(str(camera_file), str(pen_file)),
            limits=SwingLimits(0.02, min_images=15, max_images=80),
        ),
    )
    settings.set_last(station="Hall 2")

    walker = open_wizard(SourceEnvironment(SceneSimulator(scene), clock))
    rendered.operator.seat()
    walker.click_step("Camera")
    walker.until_tells("10 of 10 LEDs")
    assert walker.tells("Size fits: 1224 x 1024")
    assert walker.tells(on_one_line("Incomplete: 0"))
    walker.click("Continue to the LEDs")
    walker.until(walker.main_button().isEnabled)
    walker.click("Continue to the swing")
    walker.workbench.run.follower = GuidedOperator(rendered.operator)
    walker.until(lambda: "Review" in (walker.title(), walker.main_button().text()))
    walker.workbench.run.follower = None
    walker.until(lambda: walker.workbench.run.status.solution is not None)
    if walker.title() != "Review":
        walker.until(walker.main_button().isEnabled)
        walker.click_on(walker.main_button())
    walker.until(walker.main_button().isEnabled)
    walker.click("Accept")
    walker.until_says("ACCEPTED")

    result = walker.workbench.run.status.result
    assert result is not None
    error = np.abs(result.tip_pen - scene.tip_pen)
    assert (error < 0.03).all()  # U is 0.02 mm at most
    assert result.origin is Origin.LIVE
    record = open_record(Path(result.record))
    used = record.header.cameras[0].in_use
    assert used is not None
    assert (used.serial, used.settings.pixel_format) == ("LP01", "Mono8")
    assert record.stats.delivered >= len(record.images)
