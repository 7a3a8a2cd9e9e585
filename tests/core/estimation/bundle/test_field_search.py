"""The search for fields beside a fit knows what a fit with them would know."""

from dataclasses import replace

import numpy as np
import pytest
from tests.simulated_centers import simulate_rig_centers

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.adjustment import SearchedField, search_fields
from lightpen.estimation.bundle.bundle import Bundle, fit_bundle
from lightpen.estimation.bundle.image_fields import FieldName, seat_modes_of
from lightpen.estimation.bundle.linearised import BundleState
from lightpen.estimation.bundle.priors import priors_of
from lightpen.model.limits import USUAL
from lightpen.model.rigid import Rig, from_first, rig_of
from lightpen_extensions.simulator.scenes import row_of_cameras
from lightpen_extensions.simulator.swings import (
    paper_camera,
    paper_pen,
    seen_from,
    swing_poses,
)

PEN = replace(paper_pen(), led_sigma=0.002)
ROW = row_of_cameras(2, 1000.0)
RIGS = {"one": rig_of(paper_camera()), "two": from_first(ROW)}
MOVED = {FieldName.LENS: 20, FieldName.TILT: 2, FieldName.BEND: 0}  # an unknown


class Images:
    """Noisy images of a swing, and their fits."""

    def __init__(self, rig: Rig) -> None:
        rng = np.random.default_rng(3)
        swing = swing_poses(40, rng)
        if rig.n_cameras > 1:
            swing = seen_from(swing, ROW.rotations[0], ROW.translations[0])
        self.rig, self.swing = rig, swing
        self.pixels = simulate_rig_centers(rig, PEN, swing, 0.03, rng)

    def fit(self, shifts: FloatArray | float = 0.0) -> Bundle:
        swing = self.swing
        state = BundleState(
            self.rig, PEN, swing.tip_pen, swing.cone_cam, swing.rotations
        )
        priors, modes = priors_of(self.rig, PEN, USUAL), seat_modes_of(swing.rotations)
        return fit_bundle(self.pixels + shifts, state, priors, modes, 1.0)


@pytest.mark.parametrize("rig", RIGS)
@pytest.mark.parametrize("name", FieldName)
def test_a_field_that_is_left_out_moves_the_tip_as_the_search_says(
    rig: str, name: FieldName
) -> None:
    images = Images(RIGS[rig])
    plain = images.fit()
    searched = search_fields(plain, images.pixels)
    assert len(searched) == 2 * images.rig.n_cameras + 1
    found = of(searched, name, images.rig.n_cameras - 1)
    k = MOVED[name]
    size = 0.003  # px, too small to be found

    moved = images.fit(size * found.field.columns[..., k])

    change = moved.tip_pen - plain.tip_pen
    expected = size * found.by_unknowns[:3, k]
    assert np.abs(expected).max() > 2e-5
    atol = 0.1 * np.abs(expected).max()
    np.testing.assert_allclose(change, expected, atol=atol)
    G = found.by_unknowns
    np.testing.assert_allclose(found.covariance, G @ found.component.covariance @ G.T)


@pytest.mark.parametrize("name", FieldName)
def test_a_field_that_is_there_is_supported_by_the_images_alone(
    name: FieldName,
) -> None:
    images = Images(RIGS["two"])
    exact = of(search_fields(images.fit(), images.pixels), name, 1)
    k = MOVED[name]
    images.pixels = images.pixels + 0.4 * exact.field.columns[..., k]

    for each in search_fields(images.fit(), images.pixels):
        is_there = each.field.name is name and each.field.camera in {1, None}
        assert (each.component.gain > 20) == is_there


def of(
    searched: tuple[SearchedField, ...], name: FieldName, camera: int
) -> SearchedField:
    return next(
        each
        for each in searched
        if each.field.name is name and each.field.camera in {camera, None}
    )
