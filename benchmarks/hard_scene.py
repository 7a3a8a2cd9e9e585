"""Hard scenes: clutter, fingers, missing LEDs, blur, saturation and slips."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from benchmarks.rows import Row, numbers
from benchmarks.tips import UM
from benchmarks.workers import Workers
from tests.simulated_disturbances import flags_of, plan_disturbed

from lightpen.arrays import BoolArray, Image
from lightpen.detection.observations import observe_images
from lightpen.detection.reasons import Reason
from lightpen.estimation.calibrate import Calibration, calibrate
from lightpen.formats.images import ImageSource
from lightpen.model.ellipse import disc_images
from lightpen_extensions.simulator.image_plans import ScenePlan, render_plan
from lightpen_extensions.simulator.scene_files import scene_truth
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import leds_in_camera

SEEDS = (101, 102, 103)
N_IMAGES = 300
SPOILT = {  # and the reasons that tell the truth about it
    "slipped": {Reason.SLIPPED},
    "blurred_away": {Reason.BLURRED, Reason.EMPTY},
    "empty": {Reason.EMPTY},
}
TIP_LIMIT = 8.0  # µm


@dataclass(frozen=True)
class _Outcome:
    """What became of one scene."""

    labelled: int
    mislabelled: int
    spoilt: Counter[str]
    dropped: Counter[str]  # of the spoilt, with a reason that is true
    others_dropped: Counter[str]  # sound images, by reason
    tip_error: float
    two_stage_error: float


def hard_scene_rows(workers: Workers) -> list[Row]:
    """Return labels, dropped images and tip errors of hard scenes."""
    outcomes = workers.map(_outcome, SEEDS)
    labelled = sum(found.labelled for found in outcomes)
    mislabelled = sum(found.mislabelled for found in outcomes)
    spoilt = sum((found.spoilt for found in outcomes), Counter[str]())
    dropped = sum((found.dropped for found in outcomes), Counter[str]())
    others = sum((found.others_dropped for found in outcomes), Counter[str]())
    errors = [found.tip_error for found in outcomes]
    others_text = ", ".join(f"{n} {reason}" for reason, n in others.most_common())
    scenes = f"{len(SEEDS)} hard scenes of {N_IMAGES} images"
    return [
        Row(
            f"{scenes}: LEDs with a wrong label",
            f"{mislabelled} of {labelled}",
            "0",
            met=mislabelled == 0,
        ),
        Row(
            f"{scenes}: slipped, blurred away, empty images dropped with their reason",
            ", ".join(f"{dropped[kind]} of {spoilt[kind]}" for kind in SPOILT),
            "all",
            met=dropped == spoilt,
        ),
        Row(
            f"{scenes}: other images dropped",
            f"{others.total()} of {len(SEEDS) * N_IMAGES - spoilt.total()}"
            + (f" ({others_text})" if others else ""),
        ),
        Row(
            f"{scenes}: tip error",
            f"{numbers(errors, 1)} µm",
            f"<= {TIP_LIMIT:g} µm",
            "two-stage (paper) "
            f"{numbers([found.two_stage_error for found in outcomes], 1)}",
            max(errors) <= TIP_LIMIT,
        ),
    ]


def _outcome(seed: int) -> _Outcome:
    scene = Scene(n_images=N_IMAGES, seed=seed)
    plan = plan_disturbed(scene)
    pen = plan.measured_pen
    seen = observe_images(rendered(plan), scene.camera, pen, n_threads=1)
    calibration = calibrate(scene.camera, pen, seen)
    labelled = np.isfinite(seen.seen_pixels[..., 0])
    true_tip = np.array(scene_truth(plan)["pen"]["tip_in_leds_csv_frame_bestfit"])
    joint, two_stage = calibration.joint, calibration.two_stage
    return _Outcome(
        labelled=int(labelled.sum()),
        mislabelled=int((labelled & ~_on_their_leds(plan, calibration)).sum()),
        spoilt=Counter(_spoilt(flags) for flags in _flags(plan) if _spoilt(flags)),
        dropped=Counter(
            _spoilt(flags)
            for flags, reason in zip(_flags(plan), calibration.reasons, strict=True)
            if reason in SPOILT.get(_spoilt(flags), ())
        ),
        others_dropped=Counter(
            str(reason)
            for flags, reason in zip(_flags(plan), calibration.reasons, strict=True)
            if reason and not _spoilt(flags)
        ),
        tip_error=UM * float(np.linalg.norm(joint.tip_pen - true_tip)),
        two_stage_error=UM * float(np.linalg.norm(two_stage.tip_pen - true_tip)),
    )


def rendered(plan: ScenePlan) -> ImageSource:
    """Return the images of a scene, each rendered when it is asked for."""

    def loaders() -> Iterator[Callable[[], Image]]:
        for image_plan in plan.image_plans:
            yield partial(render_plan, plan.scene, image_plan)

    return ImageSource(
        tuple(str(image_plan.index) for image_plan in plan.image_plans), (), loaders
    )


def _flags(plan: ScenePlan) -> list[tuple[str, ...]]:
    return [flags_of(image_plan) for image_plan in plan.image_plans]


def _spoilt(flags: tuple[str, ...]) -> str:
    """Return what makes an image useless, empty if nothing does."""
    return next((kind for kind in SPOILT if kind in flags), "")


def _on_their_leds(plan: ScenePlan, calibration: Calibration) -> BoolArray:
    """Return which labelled centres lie on the disc of a lit LED of that name."""
    scene = plan.scene
    R = np.array([image_plan.rotation for image_plan in plan.image_plans])
    t = np.array([image_plan.translation for image_plan in plan.image_plans])
    lit = np.array([image_plan.view.gains > 0 for image_plan in plan.image_plans])
    discs = disc_images(
        scene.camera, *leds_in_camera(scene.pen, R, t), scene.pen.diameter / 2
    )
    radii = 2 * np.sqrt(np.linalg.eigvalsh(discs.shapes)[..., 0])
    gaps = np.linalg.norm(calibration.observations.seen_pixels - discs.centers, axis=-1)
    return np.asarray(lit & (np.nan_to_num(gaps, nan=np.inf) < radii))
