"""Images of an operator's endless swing, at any time, and of a pen at rest."""

import numpy as np
from tests.simulated_disturbances import plan_in_motion

from lightpen.arrays import FloatArray
from lightpen.model.pen import Pen
from lightpen.model.rigid import vector_from_rotation
from lightpen_extensions.simulator.image_plans import ImagePlan
from lightpen_extensions.simulator.render import View
from lightpen_extensions.simulator.scenes import Scene
from lightpen_extensions.simulator.swings import operator_postures


def live_plan(
    scene: Scene, index: int, time: float, exposure_time: float = 0.004
) -> ImagePlan:
    """Return what a camera sees of an operator's endless swing.

    Parameters
    ----------
    scene : Scene
        Pen, camera and all else.
    index : int
        Number of the image, which chooses its noise.
    time : float
        Of mid-exposure, seconds.
    exposure_time : float
        Seconds; the pen moves meanwhile.
    """
    ends = time + exposure_time * np.array([-0.5, 0.0, 0.5])
    postures = operator_postures(ends, scene.seed)
    first, middle, last = postures.rotations
    turn = vector_from_rotation(last @ first.T)
    translation = scene.cone_cam - middle @ scene.tip_pen
    return plan_in_motion(scene, index, middle, translation, turn)


def still_view(pen: Pen, rotation: FloatArray, translation: FloatArray) -> View:
    """Return the view of a pen at rest with every LED lit and nothing else."""
    return View(rotation[None], translation[None], np.ones(pen.n_leds))
