import numpy as np
import pytest

from lightpen_extensions.simulator.render import Light
from lightpen_extensions.simulator.scenes import Sensor, expose
from lightpen_extensions.simulator.view import Window

SHAPE = (400, 500)
WHOLE = Window(0, SHAPE[0], 0, SHAPE[1])


def even_light(level: float, background: float = 0.0) -> Light:
    return Light(np.full(SHAPE, level, dtype=np.float32), (WHOLE,), background)


def dark_light(background: float, gradient: tuple[float, float] = (0, 0)) -> Light:
    return Light(np.zeros(SHAPE, dtype=np.float32), (), background, gradient)


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


@pytest.mark.parametrize(
    ("bits", "background"), [(8, 0.0), (8, 0.02), (12, 0.0), (12, 0.02), (16, 0.001)]
)
def test_dark_pixels_read_as_if_each_were_drawn_on_its_own(
    bits: int, background: float
) -> None:
    sensor = Sensor(bits=bits)  # type: ignore[arg-type]
    image = expose(dark_light(background), sensor, np.random.default_rng(2))
    rng = np.random.default_rng(3)
    charge = background * sensor.full_well
    sigma = np.hypot(np.sqrt(charge), sensor.read_noise)
    charges = charge + sensor.offset + sigma * rng.standard_normal(SHAPE)
    expected = np.clip(np.rint(charges / sensor.electrons_per_dn), 0, None)
    # Both scatter: five standard deviations of the difference.
    assert image.mean() == pytest.approx(
        expected.mean(), abs=5 * expected.std() * np.sqrt(2 / image.size)
    )
    assert image.std() == pytest.approx(expected.std(), rel=0.06)
    assert image.max() == pytest.approx(expected.max(), rel=0.25)


def test_dark_pixels_are_independent_of_their_neighbours() -> None:
    image = expose(dark_light(0.0), Sensor(), np.random.default_rng(4)) > 0
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


def test_background_adds_to_the_light_and_its_gradient_runs_across_the_image() -> None:
    rng = np.random.default_rng(6)
    lit = expose(even_light(0.3, background=0.1), Sensor(), rng)
    assert lit.mean() == pytest.approx(0.4 * 255 + 0.1, abs=0.05)
    image = expose(dark_light(0.3, gradient=(0.2, -0.1)), Sensor(), rng).astype(float)
    assert image[:, 0].mean() == pytest.approx(0.2 * 255, abs=0.5)
    assert image[:, -1].mean() == pytest.approx(0.4 * 255, abs=0.5)
    assert image[0].mean() - image[-1].mean() == pytest.approx(0.1 * 255, abs=0.5)
