from lightpen.detection.observations import observe_images as detect
from lightpen.errors import LightpenError as LightpenError
from lightpen.estimation.calibrate import Calibration as Calibration
from lightpen.estimation.calibrate import calibrate as calibrate
from lightpen.estimation.calibrate import calibrate_rig as calibrate_rig
from lightpen.estimation.pivot_calibration import calibrate_pivot as calibrate_pivot
from lightpen.estimation.reports.report_warnings import reported as reported
from lightpen.estimation.reports.summary import calibration_text as calibration_text
from lightpen.estimation.reports.verdict import judge as judge
from lightpen.formats.camera_files import read_camera as read_camera
from lightpen.formats.images import find_images as find_images
from lightpen.formats.observation_files import read_poses as read_poses
from lightpen.formats.pen_files import read_pen as read_pen
from lightpen.formats.rig_files import read_rig as read_rig
from lightpen.model.camera import Camera as Camera
from lightpen.model.pen import Pen as Pen
from lightpen.record.calibrations import read_calibration as read_calibration

__all__ = [
    "Calibration",
    "Camera",
    "LightpenError",
    "Pen",
    "calibrate",
    "calibrate_pivot",
    "calibrate_rig",
    "calibration_text",
    "detect",
    "find_images",
    "judge",
    "read_calibration",
    "read_camera",
    "read_pen",
    "read_poses",
    "read_rig",
    "reported",
]
__version__: str
