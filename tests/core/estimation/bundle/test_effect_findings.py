"""Effects that a fit supports are named with their size, and with their camera."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.estimation.bundle.adjustment import adjust
from lightpen.estimation.bundle.effect_findings import FoundEffect, found_effects
from lightpen.estimation.bundle.effects import EffectName
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.model.assumptions import USUAL
from lightpen.model.rig import from_first
from lightpen.simulator.samples import row_of_cameras
from lightpen.simulator.swings import paper_pen, seen_from, swing_poses

CODES = {
    EffectName.LENS: "warning.effect-lens",
    EffectName.COMPLIANCE: "warning.effect-compliance",
    EffectName.LOOSE: "warning.effect-loose-stylus",
    EffectName.SAG: "warning.effect-sag",
    EffectName.TILT: "warning.effect-camera-tilt",
    EffectName.DELAY: "warning.effect-late-camera",
    EffectName.SHUTTER: "warning.effect-shutter",
    EffectName.STROBE: "warning.effect-strobe",
}


@pytest.mark.parametrize("name", EffectName)
def test_each_effect_has_a_message_that_names_its_camera_if_it_has_one(
    name: EffectName,
) -> None:
    effect = FoundEffect(name, "", 0.02, 0.001, 50.0, 40.0)
    finding = effect.message

    assert finding.code == CODES[name]
    of_camera = replace(effect, camera="right").message
    assert of_camera.code == "rig.of-camera"
    assert of_camera.values == {"camera": "right", "fault": finding}


@pytest.mark.parametrize(
    ("size", "sigma", "gain", "is_certain"),
    [
        (0.02, 0.001, 10.83, True),  # chi-square, once in a thousand
        (0.02, 0.001, 10.82, False),
        (-0.02, 0.019, 50.0, True),
        (-0.02, 0.021, 50.0, False),
        (0.02, None, 50.0, True),
    ],
)
def test_an_effect_is_certain_beyond_chance_and_beyond_its_uncertainty(
    size: float, sigma: float | None, gain: float, is_certain: bool
) -> None:
    found = FoundEffect(EffectName.SAG, "", size, sigma, gain)
    assert found.is_certain == is_certain


def test_a_tilt_is_found_of_the_camera_that_tilts_with_the_length_of_its_unknowns() -> (
    None
):
    rng = np.random.default_rng(3)
    row, pen = row_of_cameras(2, 1000.0), replace(paper_pen(), led_sigma=0.002)
    rig = from_first(row)
    swing = seen_from(swing_poses(40, rng), row.rotations[0], row.translations[0])
    pixels = simulate_rig_centers(rig, pen, swing, 0.03, rng)
    pixels[:, 1, :, 0] += 0.8 * swing.rotations[:, 2, 1, None]
    state = BundleState(rig, pen, swing.tip_pen, swing.cone_cam, swing.rotations)
    bundle = adjust(state, pixels, priors_of(rig, pen, USUAL)).bundle

    found = found_effects(bundle, 40.0)

    gains = [each.gain for each in found]
    assert gains == sorted(gains, reverse=True)
    tilt = found[0]
    assert (tilt.name, tilt.camera, tilt.interval_ms) == (
        EffectName.TILT,
        "right",
        40.0,
    )
    names = [(each.name, each.camera) for each in bundle.unknowns.effects]
    place = bundle.layout.effects[names.index((EffectName.TILT, 1))]
    values, spread = bundle.values[place], bundle.covariance[place, place]
    assert tilt.size == pytest.approx(np.sqrt(np.sum(values**2)))
    assert tilt.size == pytest.approx(0.8, rel=0.3)
    assert tilt.sigma == pytest.approx(
        np.sqrt(values @ spread @ values / np.sum(values**2))
    )
