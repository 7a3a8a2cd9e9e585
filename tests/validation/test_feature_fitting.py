"""The test of the software for feature fitting, in the form of ISO 10360-6."""

import numpy as np
from validation.feature_fitting import MADE, FittingResult, run_fitting_test

from lightpen.arrays import FloatArray
from lightpen_extensions.measure.measuring.features import Feature, fit_feature
from lightpen_extensions.measure.measuring.surfaces import FeatureKind

N_SETS = 3  # the dossier fits more


def failed_kinds(results: list[FittingResult]) -> set[str]:
    return {result.kind for result in results if not result.passed}


def test_every_feature_is_that_of_the_reference() -> None:
    results = run_fitting_test(n_sets=N_SETS)

    assert {result.kind for result in results} >= {"plane", "sphere", "cone"}
    assert [result for result in results if not result.passed] == []


def test_a_fit_that_leaves_a_point_out_is_noticed() -> None:
    def fit_without_last(kind: FeatureKind, points: FloatArray) -> Feature:
        return fit_feature(kind, points[:-1])

    results = run_fitting_test(fit_without_last, N_SETS)

    assert failed_kinds(results) == {kind.value for kind in MADE}


def test_a_fit_in_single_precision_is_noticed() -> None:
    def fit_rounded(kind: FeatureKind, points: FloatArray) -> Feature:
        return fit_feature(kind, points.astype(np.float32).astype(float))

    results = run_fitting_test(fit_rounded, N_SETS)

    assert failed_kinds(results) == {kind.value for kind in MADE}
