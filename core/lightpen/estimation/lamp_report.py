"""What a calibration says of the fixed lamps in view, and of a camera that moved."""

from typing import Any

from lightpen.estimation.calibrate import Calibration
from lightpen.model.rig import of_camera
from lightpen.sentences import Sentence, sentence


def lamps_record(calibration: Calibration) -> list[dict[str, Any]]:
    """Return what each camera's fixed lamps tell, as a record."""
    names = calibration.bundle.state.rig.names or ("",)
    return [
        {
            **({"camera": name} if name else {}),
            "places_px": images.path.lamps,
            "noise_px": images.path.noise,
            "moved_px": images.path.moved,
            "is_taken_out": images.path.is_followed,
            "shifts_px": images.path.shifts,
        }
        for name, images in zip(names, calibration.cameras, strict=True)
        if images.path is not None
    ]


def lamp_lines(calibration: Calibration) -> list[str]:
    """Return lines of text on the fixed lamps in view."""
    lines = []
    for images in calibration.cameras:
        path = images.path
        if path is None:
            continue
        told = f"they stay in place to {path.noise:.3f} px"
        if path.moved > 0:
            told = f"they move by {path.moved:.2f} px, "
            told += "which is taken out" if path.is_followed else "the pen does not"
        lines.append(f"Fixed lamps  {len(path.lamps)} in view; {told}")
    return lines


def lamp_warnings(calibration: Calibration) -> list[Sentence]:
    """Return what is told of lamps that moved in the images."""
    rig, warnings = calibration.bundle.state.rig, []
    for c, images in enumerate(calibration.cameras):
        path = images.path
        if path is None or path.moved == 0:
            continue
        if path.is_followed:
            told = sentence(
                "warning.camera-moved",
                "The camera moved during the swing: fixed lamps in view shift by "
                "{shift:.2f} px, and the pen with them. It is taken out. Clamp the "
                "camera, and let it warm up.",
                shift=path.moved,
            )
        else:
            x, y = path.lamps[0]
            told = sentence(
                "warning.lamp-moved",
                "The lamp at {x:.0f}, {y:.0f} px moved by {shift:.2f} px during the "
                "swing, and the pen did not move with it. Nothing is taken out. Fix "
                "the lamp, or cover it.",
                x=x,
                y=y,
                shift=path.moved,
            )
        warnings.append(of_camera(rig.names[c], told) if rig.names else told)
    return warnings
