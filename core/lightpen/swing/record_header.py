"""The header of a record, by the choices of its swing."""

from lightpen import __version__
from lightpen.formats.camera_files import CAMERA_FILE
from lightpen.formats.json_records import Plain, plain
from lightpen.formats.pen_files import PEN_FILE
from lightpen.formats.rig_files import RIG_FILE
from lightpen.local_time import local_now
from lightpen.model.origin import Origin
from lightpen.record.swings.assumed import assumption_entries
from lightpen.record.swings.header import FileCopy, Header, RigCopies
from lightpen.record.swings.recordings import is_simulated_recording
from lightpen.swing.image_sources import CameraInUse, SecondCamera
from lightpen.swing.preparation import Preparation


def record_header(
    preparation: Preparation, settings: dict[str, Plain] | None = None
) -> Header:
    """Return the header of a record that begins now; files are read again."""
    second = preparation.second
    rig_file = None if second is None else second.rig_file
    if rig_file is not None:
        camera_path = rig_file.camera_files[0]
    elif preparation.camera_file is not None:
        camera_path = preparation.camera_file.path
    else:
        raise ValueError("`camera_file` or a rig must be chosen.")
    if preparation.pen_file is None:
        raise ValueError("`pen_file` must be chosen.")
    limits, origin = preparation.limits, preparation.origin
    if origin is Origin.RECORDED and is_simulated_recording(preparation.source.place):
        origin = Origin.SIMULATED
    return Header(
        camera_file=FileCopy.of(camera_path, CAMERA_FILE),
        pen_file=FileCopy.of(preparation.pen_file.path, PEN_FILE),
        created=local_now(),
        program=f"lightpen {__version__}",
        station=preparation.names.station,
        operator=preparation.names.operator,
        tip=preparation.names.tip,
        cone=preparation.names.cone,
        units=preparation.pen_file.units,
        nominal_tip_mm=plain(preparation.nominal_tip),
        mask_px=plain(preparation.mask),
        settings={
            "pen": preparation.names.pen,
            "ball_diameter_mm": preparation.names.ball_diameter,
            "origin": str(origin),
            "source": str(preparation.source.kind),
            "source_place": preparation.source.place,
            **_camera_entries(preparation.camera_in_use),
            **_second_entries(second),
            "max_uncertainty_mm": limits.max_uncertainty,
            "min_images": limits.min_images,
            "max_images": limits.max_images,
            "min_per_field": limits.min_per_field,
            "spacing_rad": limits.spacing,
            "requires_temperature": limits.requires_temperature,
            "method": preparation.method,
            **assumption_entries(preparation.assumptions_today),
            **(settings or {}),
        },
        rig=None if second is None else _rig_copies(second),
    )


def _camera_entries(used: CameraInUse | None) -> dict[str, Plain]:
    """Return the entries of a record on the camera."""
    if used is None:
        return {}
    settings, region = used.settings, used.settings.region
    entries: dict[str, Plain] = {
        "camera_serial": used.serial,
        "exposure_us": settings.exposure_us,
        "gain_db": settings.gain_db,
        "frame_rate": settings.frame_rate,
        "pixel_format": settings.pixel_format,
        "trigger": None if settings.trigger is None else str(settings.trigger),
        "packet_size": settings.packet_size,
        "region_px": None
        if region is None
        else f"{region.width} x {region.height} at {region.x}, {region.y}",
    }
    return {name: entry for name, entry in entries.items() if entry is not None}


def _second_entries(second: SecondCamera | None) -> dict[str, Plain]:
    """Return the entries of a record on the second camera."""
    if second is None:
        return {}
    entries: dict[str, Plain] = {
        "source": str(second.source.kind),
        "source_place": second.source.place,
        **_camera_entries(second.in_use),
    }
    return {f"second_{name}": entry for name, entry in entries.items()}


def _rig_copies(second: SecondCamera) -> RigCopies | None:
    file = second.rig_file
    if file is None:
        return None
    return RigCopies(
        FileCopy.of(file.path, RIG_FILE),
        tuple(FileCopy.of(path, CAMERA_FILE) for path in file.camera_files[1:]),
        (plain(second.mask),),
    )
