import numpy as np

from lightpen.arrays import FloatArray
from lightpen.detection.labelling.hypotheses import solve_p3p
from lightpen.model.rigid import rotation_from_vector


def rays_to(points_cam: FloatArray) -> FloatArray:
    lengths = np.sqrt(np.einsum("...i,...i->...", points_cam, points_cam))
    return np.asarray(points_cam / lengths[..., None])


def random_problems(n: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return triangles, rotations and translations before the camera."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-100, 100, (n, 3, 3))
    R = rotation_from_vector(rng.uniform(-2, 2, (n, 3)))
    t = rng.uniform([-200, -200, 800], [200, 200, 1500], (n, 3))
    return points, R, t


def moved(points: FloatArray, R: FloatArray, t: FloatArray) -> FloatArray:
    return points @ np.swapaxes(R, 1, 2) + t[:, None]


def errors_of_best(points: FloatArray, R: FloatArray, t: FloatArray) -> FloatArray:
    """Return for each problem how far the nearest answer is from the truth."""
    found = solve_p3p(rays_to(moved(points, R, t)), points)
    error = np.abs(found.rotations - R[found.source]).max(axis=(1, 2))
    best = np.full(len(points), np.inf)
    np.minimum.at(best, found.source, error)
    return best


def test_the_true_pose_is_among_the_answers() -> None:
    # Near-double roots lose half the digits, so a few answers reach 1e-8 only.
    errors = errors_of_best(*random_problems(3000, seed=1))
    assert np.median(errors) < 1e-12
    assert errors.max() < 1e-5


def test_every_answer_puts_the_points_on_their_rays() -> None:
    points, R, t = random_problems(500, seed=2)
    rays = rays_to(moved(points, R, t))
    found = solve_p3p(rays, points)
    there = moved(points[found.source], found.rotations, found.translations)
    np.testing.assert_allclose(rays_to(there), rays[found.source], atol=1e-7)


def test_answers_are_proper_rotations() -> None:
    points, R, t = random_problems(500, seed=3)
    found = solve_p3p(rays_to(moved(points, R, t)), points)
    np.testing.assert_allclose(np.linalg.det(found.rotations), 1, atol=1e-9)
    products = found.rotations @ np.swapaxes(found.rotations, 1, 2)
    np.testing.assert_allclose(
        products, np.tile(np.eye(3), (len(products), 1, 1)), atol=1e-9
    )


def test_no_problem_has_more_than_four_answers() -> None:
    points, R, t = random_problems(2000, seed=4)
    found = solve_p3p(rays_to(moved(points, R, t)), points)
    assert np.bincount(found.source).max() <= 4


def test_an_isosceles_triangle_seen_face_on_is_solved() -> None:
    # The planes of the pencil then contain an axis: divisions by their coefficients
    # must be chosen with care.
    points = np.array([[[-25.0, 0, 0], [25.0, 0, 0], [0, 40.0, 0]]])
    R = np.diag([1.0, -1.0, -1.0])[None]
    errors = errors_of_best(points, R, np.array([[0.0, 0.0, 1000.0]]))
    assert errors[0] < 1e-6


def test_rays_that_no_triangle_meets_have_no_answer() -> None:
    # Ranges along nearly parallel rays differ by at most the side; here one side is
    # far too short for the angle between its rays and the lengths of the others.
    rays = rays_to(np.array([[[-1.0, 0, 1], [1.0, 0, 1], [0, 0.01, 1]]]))
    points = np.array([[[0.0, 0, 0], [1.0, 0, 0], [0.5, 300.0, 0]]])
    assert len(solve_p3p(rays, points).source) == 0


def test_a_collinear_triple_of_spots_raises_no_warning() -> None:
    rays = rays_to(np.array([[[-0.1, 0, 1], [0.0, 0, 1], [0.1, 0, 1]]]))
    points = np.array([[[-50.0, 0, 0], [0, 3.0, 0], [50.0, 0, 0]]])
    found = solve_p3p(rays, points)
    assert np.isfinite(found.rotations).all()
