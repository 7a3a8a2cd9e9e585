"""Checks whether intrinsics may be out of date for the camera in use."""

from datetime import date

from lightpen.messages import Message, message
from lightpen.model.camera import Camera

OLDEST = 365  # days
# A lens of 25 mm on an aluminium mount: 0.01 % of focal length in 5 K, by which a file
# of 24 views of a board is off as well.
LARGEST_WARMTH = 5.0  # K


def unmodelled_effects_of(
    camera: Camera, today: date, temperature_c: float | None = None, serial: str = ""
) -> tuple[Message, ...]:
    """Return why the intrinsics of a camera may no longer be valid.

    Temperature, degrees Celsius, and serial number are those at the station; what the
    file or the station does not state is not checked.
    """
    doubts = []
    if camera.folded_share:
        share = 100 * camera.folded_share
        doubts.append(message("camera-validity.fold", share=share))
    if camera.serial and serial and camera.serial.casefold() != serial.casefold():
        doubts.append(
            message("camera-validity.serial", stated=camera.serial, used=serial)
        )
    if camera.calibrated_on is not None:
        age = (today - camera.calibrated_on).days
        if age > OLDEST:
            doubts.append(
                message(
                    "camera-validity.age", age=age, day=camera.calibrated_on.isoformat()
                )
            )
    if camera.temperature_c is not None and temperature_c is not None:
        warmth = temperature_c - camera.temperature_c
        if abs(warmth) > LARGEST_WARMTH:
            doubts.append(
                message(
                    "camera-validity.temperature",
                    stated=camera.temperature_c,
                    used=temperature_c,
                )
            )
    return tuple(doubts)
