import numpy as np
import pytest
from tests.simulated_pens import NEARLY, SAMPLE_PENS, fanned_pen, near_symmetric_pen


@pytest.mark.parametrize("name", SAMPLE_PENS)
def test_pen_is_named_and_its_normals_are_unit_vectors_to_the_front(name: str) -> None:
    pen = SAMPLE_PENS[name]()
    assert pen.name == name
    np.testing.assert_allclose(np.linalg.norm(pen.normals, axis=1), 1)
    assert (pen.normals[:, 2] > 0.9).all()
    assert pen.normals.shape == pen.leds.shape


def test_near_symmetric_pen_misses_its_mirror_image_by_little() -> None:
    leds = near_symmetric_pen().leds
    mirrored = leds * np.array([-1.0, 1, 1])
    distances = np.linalg.norm(leds[:, None] - mirrored[None], axis=-1).min(axis=1)
    assert distances.max() == pytest.approx(NEARLY)


def test_fanned_discs_look_away_from_the_middle() -> None:
    pen = fanned_pen()
    assert (pen.normals[:, 0] * pen.leds[:, 0] >= 0).all()
    assert np.abs(pen.normals[4:, 0]).min() > 0.3
