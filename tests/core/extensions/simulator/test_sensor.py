import numpy as np
import pytest

from lightpen_extensions.simulator.render import Light, Window
from lightpen_extensions.simulator.scenes import Sensor, expose

SHAPE = (400, 500)
WHOLE = Window(0, SHAPE[0], 0, SHAPE[1])


DARK = Light(np.zeros(SHAPE, dtype=np.float32), ())


def even_light(level: float) -> Light:
    return Light(np.full(SHAPE, level, dtype=np.float32), (WHOLE,))


@pytest.mark.parametrize("bits", [8, 12, 16])
@pytest.mark.parametrize("level", [0.05, 0.3, 0.8])
def test_mean_and_variance_are_those_of_shot_read_and_quantisation_noise(
    bits: int, level: float
) -> None:
    sensor = Sensor(bits=bits)  # type: ignore[arg-type]
    image = expose(even_light(level), sensor, np.random.default_rng(1))
    charge = level * sensor.full_well
    step = sensor.electrons_per_dn
    mean = (charge + sensor.offset) / step
    variance = (charge + sensor.read_noise**2) / step**2 + 1 / 12
    # 200 000 pixels: standard deviation 0.3 % of the variance.
    assert image.mean() == pytest.approx(mean, abs=5 * np.sqrt(variance / image.size))
    assert image.var() == pytest.approx(variance, rel=0.015)
    assert image.dtype == (np.uint8 if bits == 8 else np.uint16)


@pytest.mark.parametrize("bits", [8, 12, 16])
def test_dark_pixels_read_as_if_each_were_drawn_on_its_own(bits: int) -> None:
    sensor = Sensor(bits=bits)  # type: ignore[arg-type]
    image = expose(DARK, sensor, np.random.default_rng(2))
    rng = np.random.default_rng(3)
    charges = sensor.offset + sensor.read_noise * rng.standard_normal(SHAPE)
    expected = np.clip(np.rint(charges / sensor.electrons_per_dn), 0, None)
    # Both scatter: five standard deviations of the difference.
    assert image.mean() == pytest.approx(
        expected.mean(), abs=5 * expected.std() * np.sqrt(2 / image.size)
    )
    assert image.std() == pytest.approx(expected.std(), rel=0.06)
    assert image.max() == pytest.approx(expected.max(), rel=0.25)


def test_dark_pixels_are_independent_of_their_neighbours() -> None:
    image = expose(DARK, Sensor(), np.random.default_rng(4)) > 0
    share = image.mean()
    assert 0.005 < share < 0.02
    for shift in (1, SHAPE[1]):
        both = np.mean(image.ravel()[shift:] & image.ravel()[:-shift])
        # Poisson number of pairs, about 31 of 200 000.
        spread = share / np.sqrt(image.size)
        assert both == pytest.approx(share**2, abs=5 * spread)
    rows = image.reshape(4, -1).mean(axis=1)
    np.testing.assert_allclose(rows, share, atol=5 * np.sqrt(4 * share / image.size))


def test_bright_light_reads_full_scale_and_no_more() -> None:
    for bits, top in ((8, 255), (12, 4095), (16, 65535)):
        sensor = Sensor(bits=bits)  # type: ignore[arg-type]
        assert sensor.full_scale == top
        image = expose(even_light(2.0), sensor, np.random.default_rng(5))
        np.testing.assert_array_equal(image, top)
