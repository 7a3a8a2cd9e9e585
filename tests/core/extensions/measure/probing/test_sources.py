"""Touches in the images of a run, held still, one an image, or as recorded."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from tests.accepted_tip import Hold, Holder

from lightpen.detection.observations import Observations, observe_centers
from lightpen.detection.reasons import Reason
from lightpen.errors import CalibrationError, UsageError
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.formats.observation_files import Centers
from lightpen_extensions.measure.probing.instruments import instrument_of_files
from lightpen_extensions.measure.probing.probing import ONE_IMAGE, ProbingRules
from lightpen_extensions.measure.probing.sources import (
    ImageLocation,
    ProbingRun,
    observe_place,
    require_leds_fit,
    touches_of,
)
from lightpen_extensions.simulator.scenes import beside
from lightpen_extensions.simulator.swings import (
    PAPER_CONE,
    PAPER_TIP,
    paper_camera,
    paper_pen,
)

TWO_IMAGES = ProbingRules(2, 1)


def observed(instrument: Instrument, places: list[float | None]) -> Observations:
    """What is seen of a tip at so many mm beside the cone; None shows no pen."""
    holder = Holder(instrument.rig, instrument.pen)
    pixels = [
        np.full((instrument.pen.n_leds, 2), np.nan)
        if place is None
        else next(holder.still(Hold((place, 0.0, 0.0)))).pixels
        for place in places
    ]
    centers = Centers(np.arange(1, len(places) + 1), np.array(pixels), Path("centers"))
    return observe_centers(centers, instrument.camera, instrument.pen)


def run(
    instrument: Instrument, places: list[float | None], rules: ProbingRules = TWO_IMAGES
) -> ProbingRun:
    return touches_of("run", [observed(instrument, places)], instrument, rules)


def named(found: ProbingRun) -> list[tuple[str, ...]]:
    names = sorted(name for touch in found.touches for name in touch.names)
    assert len(names) == len({*names})
    return [touch.names for touch in found.touches]


def test_images_of_a_run_are_parted_by_how_the_pen_is_held(
    instrument: Instrument,
) -> None:
    places = [0.0, 0.0, 0.0, None, 30.0, 30.0, 30.0, None]
    held = run(instrument, places)
    single = run(instrument, places, rules=ONE_IMAGE)
    names = observed(instrument, places).names

    assert named(held) == [names[1:3], names[5:7]]
    assert named(single) == [(each,) for i, each in enumerate(names) if i not in (3, 7)]
    for found in (held, single):
        offs = [touch.point_cam - PAPER_CONE for touch in found.touches]
        np.testing.assert_allclose(offs[0], 0.0, atol=0.1)
        np.testing.assert_allclose(offs[-1], [30.0, 0.0, 0.0], atol=0.1)
        assert [each.name for each in found.rejected] == [names[3], names[7]]
        assert found.rejected[0].reason is not Reason.NONE
        assert found.name == "run"


def test_a_run_without_pen_or_touch_is_refused_with_figures(
    instrument: Instrument,
) -> None:
    with pytest.raises(CalibrationError) as refused:
        run(instrument, [None] * 3)
    assert refused.value.message.code == "verification.no-pen"
    assert refused.value.message.values["n_images"] == 3
    with pytest.raises(CalibrationError) as refused:
        run(instrument, [0.0, 30.0, 60.0], rules=ProbingRules(7, 4))
    assert refused.value.message.code == "verification.never-still"
    said = refused.value.message.values
    assert [said[name] for name in ("n_all", "n_settling", "n_frames")] == [11, 4, 7]


@pytest.mark.parametrize(("rms", "fits"), [(0.99, True), (1.01, False)])
def test_leds_do_not_fit_by_the_median_of_a_run(rms: float, fits: bool) -> None:
    touches: list[Any] = [SimpleNamespace(rms=each) for each in (9.0, rms, 0.0)]
    if fits:
        require_leds_fit("run", touches)
        return
    with pytest.raises(CalibrationError) as refused:
        require_leds_fit("run", touches)
    assert refused.value.message.values["rms"] == rms


def test_a_place_of_more_cameras_than_the_rig_has_is_refused(
    instrument: Instrument,
) -> None:
    place: Any = SimpleNamespace(name="run", images=(None, None))
    assert ImageLocation("run", (), None).masks == (None,)
    with pytest.raises(UsageError) as refused:
        observe_place(place, instrument)
    said = refused.value.message.values
    assert (said["n_given"], said["n_cameras"]) == (2, 1)


def test_a_moment_has_the_name_of_its_first_image() -> None:
    rig, pen = beside(paper_camera(), PAPER_CONE), paper_pen()
    both = instrument_of_files(rig, pen, PAPER_TIP, 1e-6 * np.eye(3), 0.01)
    held = [next(Holder(rig, pen).still(Hold((x, 0.0, 0.0)))) for x in (0.0, 30.0)]
    views = [(each.pixels, each.others[0].pixels) for each in held]
    seen = [
        observe_centers(Centers(np.arange(2), np.array(own), Path("c")), camera, pen)
        for camera, own in zip(rig.cameras, zip(*views, strict=True), strict=True)
    ]
    names = ("", "left 2.png"), ("right 1.png", "right 2.png")
    found = touches_of(
        "run",
        [replace(each, names=own) for each, own in zip(seen, names, strict=True)],
        both,
        ONE_IMAGE,
    )

    assert named(found) == [("right 1.png",), ("left 2.png",)]
