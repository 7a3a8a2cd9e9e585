"""Write a simulated set: camera, pen, images and ground truth."""

import json
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.errors import FileError
from lightpen.formats.decoding import encode_png
from lightpen.formats.files import mark_simulated, why_unwritten, write_whole
from lightpen.formats.pen_files import write_pen
from lightpen.formats.rig_files import write_camera, write_rig
from lightpen.model.ellipse import ellipse_centers
from lightpen.model.rigid import Rig, fit_rigid
from lightpen_extensions.simulator.image_plans import (
    ImagePlan,
    ScenePlan,
    plan_rig,
    plan_scene,
    render_plan,
)
from lightpen_extensions.simulator.render import led_levels
from lightpen_extensions.simulator.scenes import Scene, beside
from lightpen_extensions.simulator.swings import leds_in_camera

Json: TypeAlias = dict[str, Any]
Report: TypeAlias = Callable[[float], None]

N_THREADS = 2  # one renders while another compresses


@dataclass(frozen=True)
class SampleFiles:
    """The files of simulated cameras: camera file, rig file, pen file."""

    camera: Path
    rig: Path
    pen: Path


def write_scene(
    scene: Scene, folder: Path, report: Report = lambda fraction: None
) -> FloatArray:
    """Write a simulated set: ``camera.yaml``, ``leds.csv``, ``images``, ``truth.json``.

    ``report`` is called with the fraction done; an exception from it stops the writing.
    Returns the true tip (3,), mm, in the frame in which the LEDs of ``leds.csv`` fit
    the true ones best. Raises `FileError` if the folder is not empty or cannot be
    written.
    """
    return write_set(plan_scene(scene), folder, report)


def write_set(
    plan: ScenePlan, folder: Path, report: Report = lambda fraction: None
) -> FloatArray:
    """Write the set of a plan; see `write_scene`."""
    images = folder / "images"
    names = [f"frame_{i + 1:04d}.png" for i in range(plan.scene.n_images)]
    _make_folders(folder, images)
    mark_simulated(folder)
    write_camera(plan.scene.camera, folder / "camera.yaml")
    _write_measured_pen(plan, folder)
    _write_images(plan, images, names, report)
    truth = {"set": folder.name, **scene_truth(plan)}
    write_whole(folder / "truth.json", json.dumps(truth, indent=1).encode())
    return _tip_in_file_frame(plan)


def write_rig_scene(
    scene: Scene, rig: Rig, folder: Path, report: Report = lambda fraction: None
) -> FloatArray:
    """Write the images of a swing by several cameras; see `write_scene`.

    One folder for each camera, and a camera file beside it; ``rig.json``, ``leds.csv``,
    ``truth.json``. The scene's camera is the first of the rig.
    """
    names = [f"frame_{index + 1:04d}.png" for index in range(scene.n_images)]
    _make_folders(folder, *(folder / name for name in rig.names))
    mark_simulated(folder)
    plans = plan_rig(scene, rig)
    camera_files = [f"{name}.yaml" for name in rig.names]
    for camera, file in zip(rig.cameras, camera_files, strict=True):
        write_camera(camera, folder / file)
    write_rig(rig, folder / "rig.json", camera_files)
    _write_measured_pen(plans[0], folder)
    views = []
    for c, (name, plan) in enumerate(zip(rig.names, plans, strict=True)):

        def part(fraction: float, c: int = c) -> None:
            report((c + fraction) / rig.n_cameras)

        _write_images(plan, folder / name, names, part)
        cam_from_rig = {
            "rotation": rig.rotations[c].tolist(),
            "translation": rig.translations[c].tolist(),
        }
        truth = scene_truth(plan, f"{name}/")
        views.append({"name": name, "cam_from_rig": cam_from_rig, **truth})
    whole = {
        "set": folder.name,
        "pen": _pen_truth(plans[0]),
        "cone_point": plans[0].scene.cone_cam.tolist(),
        "cameras": views,
    }
    write_whole(folder / "truth.json", json.dumps(whole, indent=1).encode())
    return _tip_in_file_frame(plans[0])


def _write_measured_pen(plan: ScenePlan, folder: Path) -> None:
    # A table of coordinates has no place for these.
    anonymous = replace(plan.measured_pen, name="", nominal_tip=None)
    write_pen(anonymous, folder / "leds.csv")


def _write_images(
    plan: ScenePlan, folder: Path, names: list[str], report: Report
) -> None:
    with ThreadPoolExecutor(N_THREADS) as pool:
        encoded = _in_order(
            pool,
            lambda image_plan: encode_png(render_plan(plan.scene, image_plan)),
            plan.image_plans,
        )
        for done, (name, data) in enumerate(zip(names, encoded, strict=True), start=1):
            write_whole(folder / name, data)
            report(done / len(names))


def write_sample_files(scene: Scene, folder: Path) -> SampleFiles:
    """Write the camera, rig and pen files of a scene."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _no_folder(folder, error) from error
    mark_simulated(folder)
    files = SampleFiles(
        folder / "camera.yaml", folder / "rig.json", folder / "pen.json"
    )
    rig = beside(scene.camera, scene.cone_cam)
    second = folder / "camera-2.yaml"
    write_camera(scene.camera, files.camera)
    write_camera(rig.cameras[1], second)
    write_rig(rig, files.rig, [files.camera.name, second.name])
    write_pen(scene.pen, files.pen)
    return files


def _tip_in_file_frame(plan: ScenePlan) -> FloatArray:
    R, t = fit_rigid(plan.scene.pen.leds, plan.measured_pen.leds)
    return np.asarray(R @ plan.scene.tip_pen + t)


def scene_truth(plan: ScenePlan, folder: str = "images/") -> Json:
    """Return the ground truth of a set, as JSON: lengths in mm, image points in px.

    The pen is at ``R x + T`` in the camera at mid-exposure. Of an LED there are its
    centre, projected, and that of the ellipse that its disc makes, distorted.
    """
    scene = plan.scene
    return {
        "units": "mm, px; pixel (0,0) is the centre of the top-left pixel",
        "pen": _pen_truth(plan),
        "cone_point": scene.cone_cam.tolist(),
        "seed": scene.seed,
        "frames": [
            _image_truth(plan, image_plan, folder) for image_plan in plan.image_plans
        ],
    }


def _make_folders(folder: Path, *below: Path) -> None:
    """Create a folder and its subfolders; refuse one that is not empty."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        others = [path.name for path in folder.iterdir()]
        if not others:
            for each in below:
                each.mkdir()
    except OSError as error:
        raise _no_folder(folder, error) from error
    if others:
        raise FileError("scene.not-empty", folder=folder, example=min(others))


def _no_folder(folder: Path, error: OSError) -> FileError:
    return FileError("scene.no-folder", folder=folder, reason=why_unwritten(error))


def _in_order(
    pool: ThreadPoolExecutor,
    encode: Callable[[ImagePlan], bytes],
    image_plans: tuple[ImagePlan, ...],
) -> Iterator[bytes]:
    """Yield the results in order, with only a few images in memory at a time."""
    ahead: list[Future[bytes]] = []
    try:
        for image_plan in image_plans:
            ahead.append(pool.submit(encode, image_plan))
            if len(ahead) > N_THREADS:
                yield ahead.pop(0).result()
        while ahead:
            yield ahead.pop(0).result()
    finally:
        for future in ahead:
            future.cancel()


def _pen_truth(plan: ScenePlan) -> Json:
    scene = plan.scene
    measured = plan.measured_pen.leds
    return {
        "tip": scene.tip_pen.tolist(),
        "leds": scene.pen.leds.tolist(),
        "normals": scene.pen.normals.tolist(),
        "disc_radius_mm": scene.pen.diameter / 2,
        "radiance_gain": plan.gains.tolist(),
        "leds_measured_csv": measured.tolist(),
        "tip_in_leds_csv_frame_bestfit": _tip_in_file_frame(plan).tolist(),
    }


def _image_truth(plan: ScenePlan, image_plan: ImagePlan, folder: str) -> Json:
    swing, index = plan.swing, image_plan.index
    return {
        "file": f"{folder}frame_{index + 1:04d}.png",
        "R": image_plan.rotation.tolist(),
        "T": image_plan.translation.tolist(),
        "tip_cam": swing.tips_cam[index].tolist(),
        "tip_in_cone": not swing.slipped[index],
        "leds": _led_truths(plan.scene, image_plan),
    }


def _led_truths(scene: Scene, image_plan: ImagePlan) -> list[Json]:
    camera, pen = scene.camera, scene.pen
    leds, normals = leds_in_camera(pen, image_plan.rotation, image_plan.translation)
    levels = image_plan.view.gains * led_levels(leds, normals, image_plan.optics)
    projected = camera.project(leds)
    centers = ellipse_centers(camera, leds, normals, pen.diameter / 2)
    return [
        {
            "led": led + 1,
            "proj": projected[led].tolist(),
            "ellipse_center": centers[led].tolist(),
            "visible": bool(levels[led] > 0),
            "saturated": bool(levels[led] >= 1),
        }
        for led in range(pen.n_leds)
    ]
