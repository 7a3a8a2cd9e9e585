"""Poses guessed from spots of one image do not depend on what is labelled beside it."""

import numpy as np
import pytest
from benchmarks.labelling import CAMERA, PEN, random_view

from lightpen.detection.labelling.constellation import constellation_of, spot_arrays
from lightpen.detection.labelling.hypotheses import SearchEffort, poses_from_triples
from lightpen.detection.labelling.labels import EFFORTS


@pytest.mark.parametrize("effort", EFFORTS)
def test_other_images_do_not_change_the_poses_guessed_for_one(
    effort: SearchEffort,
) -> None:
    rng = np.random.default_rng(4)
    crowded = random_view(rng, 0, 10).spots
    pen = constellation_of(PEN)
    for n_lamps in (0, 2):
        spots = random_view(rng, 0, n_lamps).spots
        alone = poses_from_triples(
            spot_arrays([spots], CAMERA, pen.radius), pen, effort
        )
        beside = poses_from_triples(
            spot_arrays([spots, crowded], CAMERA, pen.radius), pen, effort
        )
        beside = beside.of(beside.image == 0)

        np.testing.assert_array_equal(alone.spot, beside.spot)
        np.testing.assert_allclose(alone.t, beside.t, rtol=1e-9)
