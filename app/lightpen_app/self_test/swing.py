"""A rendered swing, recorded as one that was interrupted before its verdict."""

from dataclasses import replace
from pathlib import Path

from lightpen.detection.sighting import look
from lightpen.formats.opened_files import CameraFile, PenFile
from lightpen.model.limits import SwingLimits
from lightpen.record.names import Names
from lightpen.record.writing import RecordWriter
from lightpen.simulator.image_plans import plan_scene, render_plan
from lightpen.simulator.scene_files import write_sample_files
from lightpen.simulator.scenes import Scene
from lightpen.simulator.swings import paper_camera
from lightpen.swing.preparation import Preparation
from lightpen_app.self_test.report import SelfTestError

N_IMAGES = 60
PERIOD = 0.1  # s from image to image
# With blanks and letters that a Windows of another language has no code page for.
NAMES = Names("Prüfstand 1", "自检", "SELF-TEST", "T-1 ä", "C-1", 10.0)
# A quarter of the usual pixels: the test is to be over soon.
SCENE = Scene(n_images=N_IMAGES, camera=paper_camera(binning=2), led_noise=0.0)


def record_swing(folder: Path, files: Path) -> None:
    """Render the images of `SCENE` and record them, each with what it shows.

    Parameters
    ----------
    folder : Path
        Of the record.
    files : Path
        Folder for the files of camera and pen.

    Raises
    ------
    SelfTestError
        The pen is not found in an image.
    """
    written = write_sample_files(SCENE, files)
    preparation = Preparation(
        names=NAMES,
        camera_file=CameraFile.read(written.camera),
        pen_file=PenFile.read(written.pen),
        limits=replace(SwingLimits(), min_per_field=0),
    )
    setup = preparation.swing_setup()
    with RecordWriter.create(folder, preparation.header()) as writer:
        for image_plan in plan_scene(SCENE).image_plans:
            image = render_plan(SCENE, image_plan)
            seen = look(image, setup.camera, setup.pen)
            if not seen.has_pose:
                raise SelfTestError(
                    f"The pen is not found in rendered image {image_plan.index + 1}."
                )
            writer.append(
                *(image, seen.pixels, seen.rotation, seen.translation),
                image_plan.index * PERIOD,
            )
