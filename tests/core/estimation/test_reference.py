"""Every figure of a calibration is as before, in swings that have something of all.

That a figure is right is shown by the other tests; that none changes unnoticed, here.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.small_records import entries_of
from tests.reference import assert_as_before, parts_of, text_figures
from tests.simulated_centers import correlated_noise, simulate_rig_centers

from lightpen.arrays import FloatArray
from lightpen.detection.observations import Observations, observe_centers
from lightpen.detection.rig_observations import observe_rig_centers
from lightpen.estimation.bundle.disc_diameter import DiameterReading
from lightpen.estimation.bundle.priors import ConeSeparation
from lightpen.estimation.bundle.unknowns import led_basis
from lightpen.estimation.calibrate import Calibration, calibrate, calibrate_rig
from lightpen.estimation.contact.camera_motion import follow_lamps
from lightpen.estimation.monte_carlo import run_trial, trials_of
from lightpen.estimation.pivot.pivot import contact_matrix, fit_pivot
from lightpen.estimation.pivot.pivot_groups import find_groups
from lightpen.estimation.pivot_calibration import calibrate_pivot
from lightpen.estimation.reports.methods import METHODS
from lightpen.estimation.reports.pivot_report import pivot_record
from lightpen.estimation.reports.report import calibration_record
from lightpen.estimation.reports.report_warnings import warnings_of
from lightpen.estimation.reports.summary import calibration_text, pivot_text
from lightpen.estimation.reports.verdict import judge
from lightpen.estimation.running_tip import fit_running_tip
from lightpen.estimation.spin import fit_spin
from lightpen.estimation.statistics.correlation import correlated_covariance
from lightpen.estimation.uncertainty.prediction import predict_uncertainty
from lightpen.estimation.uncertainty.second_cone import SecondSwing
from lightpen.formats.hashes import InputFile, Inputs
from lightpen.formats.observation_files import Centers
from lightpen.formats.pairing import pair_images
from lightpen.model.assumptions import USUAL
from lightpen.model.camera import Camera
from lightpen.model.ellipse import disc_images
from lightpen.model.lens_field import LensField
from lightpen.model.limits import SwingLimits
from lightpen.model.pen import Pen, grown
from lightpen.model.rig import from_first
from lightpen.model.rigid import rotation_from_vector
from lightpen.simulator.postures import Postures
from lightpen.simulator.samples import row_of_cameras
from lightpen.simulator.swings import (
    PAPER_CONE,
    Swing,
    leds_in_camera,
    paper_camera,
    paper_pen,
    perturbed_pen,
    seen_from,
    simulate_centers,
    swing_from_postures,
    swing_poses,
)

CAMERA = paper_camera()
PEN = replace(paper_pen(), led_sigma=0.002)
BARE = replace(paper_pen(), led_sigma=None, scale_sigma=None, diameter_sigma=None)
FILE = InputFile(Path("file"), 64 * "0")
INPUTS = Inputs(FILE, FILE, (FILE,), PEN.nominal_tip)
LIMITS = SwingLimits(max_uncertainty=0.05, min_images=12)
N_IMAGES = 40


def swing_of(seed: int, n_images: int = N_IMAGES) -> Swing:
    return swing_poses(n_images, np.random.default_rng(seed))


def lasting(seed: int, correlation: float, n_images: int = N_IMAGES) -> FloatArray:
    """Return noise of unit variance that lasts from image to image."""
    fresh = np.random.default_rng(seed).standard_normal((n_images, PEN.n_leds, 2))
    noise = fresh.copy()
    for i in range(1, n_images):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * fresh[i]
    return noise


def observed(
    swing: Swing, errors: FloatArray, camera: Camera = CAMERA, pen: Pen = PEN
) -> Observations:
    exact = simulate_centers(
        *(CAMERA, PEN, swing.rotations, swing.translations),
        *(0.0, np.random.default_rng(0)),
    )
    centers = Centers(np.arange(len(swing)) + 1, exact + errors, Path("simulated"))
    return observe_centers(centers, camera, pen)


def disc_areas(swing: Swing, diameter: float, rng: np.random.Generator) -> FloatArray:
    """Return areas of discs, (N, L), px^2, with noise of 0.2 percent."""
    leds, normals = leds_in_camera(PEN, swing.rotations, swing.translations)
    shapes = disc_images(CAMERA, leds, normals, diameter / 2).shapes
    areas = 4 * np.pi * np.sqrt(np.linalg.det(shapes))
    return np.asarray(areas * (1 + 0.002 * rng.standard_normal(areas.shape)))


def usual() -> Calibration:
    """Images that slipped, do not fit, or lack LEDs are left out."""
    swing, errors = swing_of(1), 0.03 * lasting(1, 0.0)
    translations = swing.translations.copy()
    translations[5:8] += [0.5, 0.0, 0.2]
    errors[11] += np.linspace(-2, 2, PEN.n_leds)[:, None]
    errors[20, 2:] = np.nan
    errors[25:, 3] = np.nan
    moved = replace(swing, translations=translations)
    return calibrate(CAMERA, PEN, observed(moved, errors))


def restless() -> Calibration:
    """Noise that lasts, a seat that jitters and wanders, and a slow drift."""
    rng = np.random.default_rng(2)
    swing = swing_of(2, 60)
    moves = 0.008 * rng.standard_normal((60, 3))
    moves += np.linspace(0, 0.06, 60)[:, None] * [1.0, 0.0, 0.5]
    turns = 2 * np.arctan2(swing.rotations[:, 0, 1], swing.rotations[:, 2, 1])
    moves[:, 0] += 0.02 * np.cos(turns)
    moved = replace(swing, translations=swing.translations + moves)
    return calibrate(CAMERA, PEN, observed(moved, 0.05 * lasting(2, 0.8, 60)))


def unstated() -> Calibration:
    """No uncertainty in files, LEDs off theirs, a warm pen, other assumptions."""
    camera = replace(CAMERA, covariance=None)
    longer = replace(camera, fx=1.002 * CAMERA.fx, fy=1.002 * CAMERA.fy)
    assumptions = replace(USUAL, temperature_c=24.0, temperature=0.3, form_error=4e-4)
    pen = perturbed_pen(BARE, 0.03, np.random.default_rng(3))
    seen = observed(swing_of(3), 0.03 * lasting(3, 0.0), longer, pen)
    return calibrate(longer, pen, seen, assumptions)


def spoilt_files() -> Calibration:
    """A camera and a pen file that are off by more than they state, and one LED."""
    wrong = replace(
        CAMERA, fx=1.004 * CAMERA.fx, fy=1.004 * CAMERA.fy, cx=CAMERA.cx + 4
    )
    leds = grown(PEN, 3e-4).leds.copy()
    leds[2] += [0.05, -0.08, 0.0]
    pen = replace(PEN, leds=leds)
    return calibrate(
        wrong, pen, observed(swing_of(4), 0.03 * lasting(4, 0.0), wrong, pen)
    )


def followed() -> Calibration:
    """A camera that moves, with lamps that tell, and discs whose areas are measured."""
    swing, rng = swing_of(5), np.random.default_rng(5)
    way = np.outer(np.sin(np.linspace(0, 4, N_IMAGES)), [1.5, 0.8])
    lamps = np.array([[1100.0, 900.0], [1300.0, 1100.0]]) + way[:, None]
    lamps += 0.02 * rng.standard_normal(lamps.shape)
    seen = observed(swing, way[:, None] + 0.03 * lasting(5, 0.0))
    areas = disc_areas(swing, 1.002 * PEN.diameter, rng)
    seen = replace(seen, lamps=lamps, areas=areas, edge_widths=np.full(N_IMAGES, 2.2))
    return calibrate(CAMERA, PEN, seen)


def larger_discs() -> Calibration:
    """Larger discs than the file has, that may be turned, and a stated lens field."""
    swing, rng = swing_of(9, 25), np.random.default_rng(9)
    field = LensField.of(CAMERA.width, CAMERA.height, 0.05, 300.0)
    waves = 0.1 * np.sin(field.nodes / 260.0)
    field = replace(field, values=waves, covariance=0.1 * field.covariance)
    camera = replace(CAMERA, lens_field=field)
    seen = observed(swing, 0.03 * lasting(9, 0.7, 25), camera)
    areas = disc_areas(swing, 1.02 * PEN.diameter, rng)
    seen = replace(seen, areas=areas, edge_widths=np.full(25, 2.2))
    turns = np.diag([0.1, 0.2, 0.3]) ** 2
    pen = replace(PEN, diameter_sigma=0.002, normal_covariance=turns)
    return calibrate(camera, pen, seen)


def by_two_cones() -> Calibration:
    """In the second swing, an image does not fit, and LEDs are missing."""
    pen = replace(PEN, scale_sigma=None, expansion=None)
    cones = PAPER_CONE + np.array([[-70.0, 0.0, 0.0], [70.0, 0.0, 10.0]])
    rng, errors = np.random.default_rng(6), 0.03 * lasting(1, 0.0, 20)
    first = observed(
        swing_poses(25, rng, cone_cam=cones[0]), 0.03 * lasting(0, 0.0, 25)
    )
    errors[4] += np.linspace(-2, 2, PEN.n_leds)[:, None]
    errors[9, 3:] = errors[12:, 5] = np.nan
    second = observed(swing_poses(20, rng, cone_cam=cones[1]), errors)
    apart = float(np.linalg.norm(cones[1] - cones[0]))
    return calibrate(
        *(CAMERA, pen, first),
        second=SecondSwing(second, ConeSeparation(apart + 0.02, 0.002)),
    )


def by_two_cameras() -> Calibration:
    """The second camera stands a little elsewhere than the file has it."""
    row = row_of_cameras(2, 1000.0)
    rig, places = from_first(row), (row.rotations[0], row.translations[0])
    swing, rng = seen_from(swing_of(7, 25), *places), np.random.default_rng(7)
    pixels = simulate_rig_centers(rig, PEN, swing, 0.03, rng)
    pixels[3, 1], pixels[9, 0, 2:], pixels[14, 1, :4] = np.nan, np.nan, np.nan
    turned = rotation_from_vector(np.array([2e-4, -3e-4, 1e-4]))
    rotations = np.stack([rig.rotations[0], turned @ rig.rotations[1]])
    filed = replace(rig, rotations=rotations)
    centers = [
        Centers(taken, pixels[taken, c], Path("simulated"))
        for c in range(2)
        for taken in [np.flatnonzero(np.isfinite(pixels[:, c]).any(axis=(1, 2)))]
    ]
    pairing = pair_images([list(map(str, c.frames)) for c in centers], rig.names)
    return calibrate_rig(filed, PEN, observe_rig_centers(centers, pairing, filed, PEN))


def steadily(times: FloatArray) -> Swing:
    """Return a swing round the cone, at times in image intervals."""
    phase = 2 * np.pi * times / N_IMAGES
    tilts = np.radians(22 + 7 * np.sin(0.37 * phase))
    return swing_from_postures(Postures(tilts, phase, 0.4 * np.sin(0.71 * phase)))


def by_a_late_camera() -> Calibration:
    """Its file is off and states nothing, nor does the rig's; an LED is noisy."""
    row, rng = row_of_cameras(2, 1000.0), np.random.default_rng(12)
    rig, places = from_first(row), (row.rotations[0], row.translations[0])
    moments = np.arange(28.0)
    pixels = np.stack(
        [
            simulate_rig_centers(rig, PEN, seen_from(swing, *places), 0.0, rng)[:, c]
            for c, swing in enumerate((steadily(moments), steadily(moments + 0.03)))
        ],
        axis=1,
    )
    sigmas = 0.03 * np.exp(0.5 * rng.standard_normal(pixels.shape[:-1]))
    noise = sigmas[..., None] * rng.standard_normal(pixels.shape)
    noise[:, 0, 4] *= 5
    pixels += noise
    pixels[7, 1], pixels[21, 0] = np.nan, np.nan
    centers = [
        Centers(taken, pixels[taken, c], Path("simulated"))
        for c in range(2)
        for taken in [np.flatnonzero(np.isfinite(pixels[:, c]).any(axis=(1, 2)))]
    ]
    off = rig.cameras[1].with_intrinsics(
        rig.cameras[1].intrinsics * ([1.001] * 2 + 7 * [1])
    )
    filed = replace(
        rig, cameras=(rig.cameras[0], replace(off, covariance=None)), covariance=None
    )
    pairing = pair_images([list(map(str, c.frames)) for c in centers], rig.names)
    seen = observe_rig_centers(centers, pairing, filed, PEN)
    weighed = [
        replace(each, sigmas=np.where(np.isfinite(each.sigmas), sigmas[:, c], np.nan))
        for c, each in enumerate(seen)
    ]
    return calibrate_rig(filed, PEN, weighed)


def loose() -> Calibration:
    """A stylus that jumps to the side of the lean, in an oval seat that jitters.

    The LED file has a covariance, and one of the normals.
    """
    swing, basis = swing_of(11, 30), led_basis(PEN.leds)
    across = swing.rotations[:, :, 1] - swing.rotations[:, :, 1].mean(axis=0)
    across[:, 1] = 0.0
    angle = np.arctan2(across[:, 2], across[:, 0])
    moves = 0.03 * across / np.linalg.norm(across, axis=1, keepdims=True)
    moves[:, 0] += 0.03 * (np.cos(angle) + np.cos(3 * angle))
    moves[:, 2] += 0.03 * (np.sin(3 * angle) - np.sin(angle))
    pen = replace(
        PEN,
        led_sigma=None,
        led_covariance=0.002**2 * basis @ basis.T,
        normal_covariance=0.01**2 * np.eye(3),
    )
    moved = replace(swing, translations=swing.translations + moves)
    return calibrate(
        CAMERA, pen, observed(moved, 0.02 * lasting(11, 0.0, 30), CAMERA, pen)
    )


def uneven() -> Calibration:
    """LEDs that blink in turn and differ in noise, on a stylus that bends."""

    def at(times: FloatArray) -> Swing:
        swing = steadily(times)
        axes = swing.rotations[:, :, 1]
        bent = swing.translations + 0.06 * (axes - axes.mean(axis=0))
        return replace(swing, translations=bent)

    rng, pixels = np.random.default_rng(8), np.zeros((N_IMAGES, PEN.n_leds, 2))
    for j in range(PEN.n_leds):
        swing = at(np.arange(N_IMAGES, dtype=float) + 0.004 * (j - 4.5))
        poses = swing.rotations, swing.translations
        pixels[:, j] = simulate_centers(CAMERA, PEN, *poses, 0.0, rng)[:, j]
    sigmas = 0.03 * np.exp(0.5 * rng.standard_normal(pixels.shape[:2]))
    sigmas[:, 3] *= 5
    pixels += sigmas[..., None] * rng.standard_normal(pixels.shape)
    sigmas[:, 3] /= 5
    centers = Centers(np.arange(N_IMAGES), pixels, Path("simulated"))
    seen = observe_centers(centers, CAMERA, PEN)
    return calibrate(CAMERA, PEN, replace(seen, sigmas=sigmas))


def lobed(seed: int, n_lobes: int) -> Calibration:
    """A seat 10 um out of round."""
    swing = swing_of(seed)
    right, away = swing.rotations[:, 0, 1], swing.rotations[:, 2, 1]
    angle = np.arctan2(away, right)
    sides = np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=1)
    moves = 0.01 * np.cos(n_lobes * angle - 0.7)[:, None] * sides
    moved = replace(swing, translations=swing.translations + moves)
    return calibrate(CAMERA, PEN, observed(moved, 0.03 * lasting(seed, 0.0)))


def two_lobes() -> Calibration:
    """An oval seat is found; waves round the cone are expected beside it."""
    return lobed(11, 2)


def three_lobes() -> Calibration:
    """Waves round the cone are found; an oval seat is expected beside them."""
    return lobed(12, 3)


SWINGS: dict[str, Callable[[], Calibration]] = {
    each.__name__: each
    for each in (
        *(usual, restless, unstated, spoilt_files, followed, uneven),
        *(larger_discs, two_lobes, three_lobes, loose),
        *(by_two_cones, by_two_cameras, by_a_late_camera),
    )
}


Named = tuple[str, Calibration]
# Those that take longest are compared with the slow tests.
SLOW = "by_a_late_camera", "larger_discs"
MARKED = [
    pytest.param(name, marks=pytest.mark.slow) if name in SLOW else name
    for name in SWINGS
]


@pytest.fixture(scope="module")
def named(request: pytest.FixtureRequest) -> Named:
    """The name and the calibration of one of the swings."""
    return request.param, SWINGS[request.param]()


@pytest.mark.parametrize("named", MARKED, indirect=True)
def test_the_figures_of_a_printed_calibration_are_as_before(named: Named) -> None:
    name, calibration = named
    verdict = judge(calibration, LIMITS)
    texts = [
        calibration_text(calibration, method, PEN.nominal_tip, verdict)
        for method in METHODS
    ]

    assert_as_before(f"printed-{name}", [text_figures(text) for text in texts])


@pytest.mark.parametrize("named", MARKED, indirect=True)
def test_the_record_of_a_calibration_is_as_before(named: Named) -> None:
    name, calibration = named
    record: dict[str, Any] = entries_of(
        calibration_record(calibration, INPUTS, "joint", LIMITS)
    )
    for changing in ("program", "created", "inputs", "checksum", "format"):
        record.pop(changing, None)
    record["warnings"] = warnings_of(calibration)
    # Its last steps are quotients of what is rounded.
    del record["methods"]["two-stage"]["convergence"]["alpha"]

    assert_as_before(
        f"calibration-{name}",
        {
            **record,
            "instrument_sigma": (np.sqrt(np.diag(calibration.instrument.covariance))),
            "rms": calibration.rms,
            "moved": calibration.moved,
        },
    )


@pytest.mark.parametrize(
    "named", ["usual", "restless", "unstated", "loose", "by_two_cameras"], indirect=True
)
def test_all_parts_of_a_calibration_are_as_before(named: Named) -> None:
    name, calibration = named
    parts = parts_of(calibration)
    for steps in ("step_lengths", "increments", "iterates", "objectives"):
        parts["two_stage"].pop(steps)

    assert_as_before(f"parts-{name}", parts)


@pytest.mark.parametrize(
    "named", ["restless", "by_two_cones", "unstated", "loose"], indirect=True
)
def test_what_trials_are_drawn_from_is_as_before(named: Named) -> None:
    name, calibration = named
    trials = trials_of(calibration)
    reading = DiameterReading(trials.pen.diameter, 0.04, 0.02)
    read = replace(
        trials,
        edge_widths=np.full_like(trials.edge_widths, 1.2),
        priors=replace(trials.priors, reading=reading),
    )

    errors = [run_trial(each, 3) for each in (trials, read)]
    assert_as_before(f"trials-{name}", {**vars(trials), "errors": errors})


@pytest.mark.parametrize("named", ["usual", "restless", "unstated"], indirect=True)
def test_what_more_images_are_predicted_to_give_is_as_before(named: Named) -> None:
    name, calibration = named
    pixels = calibration.observations.pixels[calibration.used][:, None]
    state, joint = calibration.bundle.state, calibration.joint
    prediction = predict_uncertainty(
        state.rig, state.pen, pixels, joint, joint.sigma, USUAL
    )
    found = {
        f"{sigma} {assumed.form_error}": prediction.predicted(joint, sigma, assumed)
        for sigma in (0.02, 0.1)
        for assumed in (USUAL, replace(USUAL, form_error=0.002))
    }

    assert_as_before(
        f"prediction-{name}",
        {key: [each.uncertainty, each.floor] for key, each in found.items()},
    )


def test_the_running_tip_is_as_before() -> None:
    swing, rng = swing_of(8), np.random.default_rng(8)
    draws = rng.standard_normal((N_IMAGES, 6, 6)) * ([1e-4] * 3 + [0.02] * 3)
    covariances = np.swapaxes(draws, 1, 2) @ draws
    noise = 0.02 * rng.standard_normal((N_IMAGES, 3))
    running = fit_running_tip(
        *(swing.rotations, swing.translations + noise, covariances), *(swing.tip_pen, 8)
    )

    assert_as_before("running-tip", vars(running))


def spun(n: int, turn: float, wobble: float, lasting: float, seed: int) -> FloatArray:
    """Return rotations about an axis that is tilted as by a hand."""
    rng = np.random.default_rng(seed)
    axis = np.array([0.1, -0.98, -0.17])
    turns = rotation_from_vector(np.linspace(0, turn, n)[:, None] * axis)
    tilts = rotation_from_vector(wobble * correlated_noise(n, lasting, rng))
    return np.asarray(tilts @ rotation_from_vector(np.array([0.3, 0.2, -0.1])) @ turns)


def test_spins_are_as_before() -> None:
    found = [
        vars(fit_spin(spun(*each)))
        for each in (
            *((40, 1.8, 0.01, 0.0, 10), (10, 6.2, 0.003, 0.0, 1)),
            *((25, 0.8, 0.002, 0.9, 2), (60, 9.0, 0.01, 0.7, 3)),
        )
    ]

    assert_as_before("spins", found)


def test_lamps_are_followed_as_before() -> None:
    rng, time = np.random.default_rng(11), np.linspace(0, 1, 30)
    ways = [
        0 * time,
        time,
        np.sin(7 * time),
        1.0 * (time > 0.4),
        rng.normal(0, 0.1, 30),
    ]
    found = []
    for n_lamps, way in enumerate(ways, 1):
        lamps = rng.uniform(500, 900, (n_lamps, 2)) + np.outer(way, [1.0, 0.4])[:, None]
        lamps += 0.02 * rng.standard_normal(lamps.shape)
        lamps[::7] = np.nan
        lamps[3:9, 0] = np.nan
        path = follow_lamps(lamps)
        assert path is not None
        found.append({**vars(path), "moved": path.moved})

    assert_as_before("lamps", found)


def test_covariances_of_residuals_that_hang_together_are_as_before() -> None:
    found = []
    for n, lasts in ((6, 0.0), (40, 0.0), (40, 0.7), (120, 0.3), (120, 0.97)):
        rng = np.random.default_rng(n)
        design = contact_matrix(swing_poses(n, rng, "operator").rotations)
        noise = correlated_noise(n, lasts, rng) * [1.0, 0.3, 2.0]
        flat = design.reshape(-1, 6)
        off = noise.ravel() - flat @ np.linalg.lstsq(flat, noise.ravel(), rcond=None)[0]
        residuals = off.reshape(n, 3)
        found += [correlated_covariance(design, residuals, x) for x in (0.0, 0.5)]

    assert_as_before("correlated", found)


# Number of poses, share of another tip or pivot and how far off these are, mm.
GROUPS = [
    *((60, 0.5, 4.0, 0.0), (60, 0.3, 0.0, 3.0), (60, 0.12, 0.0, 8.0)),
    *((60, 0.5, 0.6, 0.5), (60, 0.2, 1.0, 0.3), (13, 0.5, 5.0, 0.0)),
    *((60, 0.08, 9.0, 0.0), (60, 0.5, 0.0, 0.4), (700, 0.4, 2.0, 1.0)),
    # Two that only the order of the poses tells.
    *((120, 0.3, 0.8, 0.5), (60, 0.5, 0.0, 1.0)),
]


@pytest.mark.parametrize("mixed", [False, True])
def test_groups_of_poses_are_as_before(mixed: bool) -> None:
    """The others are in between, or the last."""
    found: list[Any] = []
    for seed, (n, share, tip, pivot) in enumerate(GROUPS):
        rng = np.random.default_rng(seed)
        rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (n, 3)))
        others = np.arange(n) >= (1 - share) * n
        others = rng.permutation(others) if mixed else others
        translations = np.array([10.0, 20.0, 800.0]) - rotations @ [2.0, -1.0, 150.0]
        moves = rotations @ [0.0, tip, 0.0] + [pivot, 0.0, 0.0]
        translations += others[:, None] * moves
        translations += 0.3 * correlated_noise(n, 0.3, rng)
        translations[n // 2] += 40.0
        used = fit_pivot(rotations, translations).used
        groups = find_groups(rotations, translations, used)
        found.append({"found": groups is not None, **(vars(groups) if groups else {})})

    assert_as_before(f"groups-{mixed}", dict(enumerate(found)))


@pytest.mark.parametrize("times", [0.5, 1.0, 3.0])
def test_a_tip_by_poses_of_known_covariance_is_as_before(times: float) -> None:
    """The noise is a multiple of what is stated."""
    rng = np.random.default_rng(13)
    rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (40, 3)))
    translations = np.array([10.0, 20.0, 800.0]) - rotations @ [2.0, -1.0, 150.0]
    roots = rng.standard_normal((40, 6, 6)) * ([2e-4] * 3 + [0.03] * 3)
    covariances = np.swapaxes(roots, 1, 2) @ roots
    off = times * np.einsum("nji,nj->ni", roots, rng.standard_normal((40, 6)))
    turned = rotation_from_vector(off[:, :3]) @ rotations
    translations += off[:, 3:]
    translations[7] += 1.0
    found = calibrate_pivot(turned, translations, covariances)

    assert_as_before(
        f"pivot-stated-{times}",
        {**vars(found.fit), "correlated": found.covariance, "w": list(found.warnings)},
    )


@pytest.mark.parametrize("robust", [True, False])
def test_a_tip_by_poses_is_as_before(robust: bool) -> None:
    """A third of the poses are of another pivot; some are far off."""
    rng = np.random.default_rng(9)
    rotations = rotation_from_vector(rng.uniform(-0.6, 0.6, (60, 3)))
    pivots = np.where(np.arange(60)[:, None] < 20, [10.0, 20.0, 803.0], [10.0, 20, 800])
    translations = pivots - rotations @ [2.0, -1.0, 150.0]
    translations += 0.1 * rng.standard_normal((60, 3))
    translations[::13] += 40.0
    found = calibrate_pivot(rotations, translations, robust=robust)
    record = pivot_record(found, FILE, least_squares=not robust)
    for changing in ("program", "created", "input", "inputs", "checksum"):
        record.pop(changing, None)

    assert_as_before(
        f"pivot-{robust}", {**record, "text": text_figures(pivot_text(found))}
    )
