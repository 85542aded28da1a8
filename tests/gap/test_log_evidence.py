"""The evidence of a linear model against brute force, and against a planted wrong covariance."""

from types import SimpleNamespace

import numpy as np
from scipy.stats import multivariate_normal
from support.bench import unit_of

from backdrive_bayes.gap.evidence import formula_error, log_evidence
from backdrive_bayes.gap.setting import Setting
from backdrive_bayes.model.registry import BASELINE, members_named

N, RECORDS = 30, np.repeat([0, 1], 15)


class LinearSetting:
    """Stands where a setting stands: white noise and a smooth misfit."""

    def __init__(self, noise_sd=0.5):
        self.noise_sd = noise_sd
        self.places = SimpleNamespace(record=RECORDS)

    def covariance(self, *terms):
        return self.noise_sd**2 * np.eye(N)

    def kernel(self, name, length):
        return np.ones((N, N))


def hypothesis(seed=0, columns=2, contributions=()):
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(size=(N, columns))
    residual = rng.normal(size=N)
    problem = SimpleNamespace(noise_dof=1e9, dof=N - 2)
    return SimpleNamespace(
        z=np.zeros(columns), residual=residual, jacobian=jacobian, problem=problem, contributions=contributions
    )


def brute_force(fitted, covariance):
    """Offsets of each record with a flat prior of huge width, which cancels between hypotheses."""
    ones = (RECORDS[:, None] == [0, 1]).astype(float)
    total = covariance + fitted.jacobian @ fitted.jacobian.T + 1e5 * ones @ ones.T
    return multivariate_normal(np.zeros(N), total).logpdf(fitted.residual)


def test_evidence_ratios_are_those_of_brute_force():
    setting = LinearSetting()
    small, large = hypothesis(columns=1), hypothesis(columns=4)
    found = log_evidence(setting, large) - log_evidence(setting, small)
    expected = brute_force(large, setting.covariance()) - brute_force(small, setting.covariance())
    np.testing.assert_allclose(found, expected, atol=1e-4)


def test_a_wrong_noise_level_is_noticed():
    right, wrong = LinearSetting(), LinearSetting(noise_sd=0.7)
    small, large = hypothesis(columns=1), hypothesis(columns=4)
    found = log_evidence(wrong, large) - log_evidence(wrong, small)
    expected = brute_force(large, right.covariance()) - brute_force(small, right.covariance())
    assert np.all(np.abs(found - expected) > 0.5)


def test_where_the_mode_lies_does_not_matter_for_a_linear_model():
    setting, fitted = LinearSetting(), hypothesis()
    z = np.array([0.7, -0.3])
    moved = SimpleNamespace(**{**vars(fitted), "z": z, "residual": fitted.residual + fitted.jacobian @ z})
    np.testing.assert_allclose(log_evidence(setting, moved), log_evidence(setting, fitted), atol=1e-8)


def test_formula_error_lowers_the_evidence_of_what_needs_no_error():
    setting, gain = LinearSetting(), []
    for seed in range(40):
        exact = hypothesis(seed)
        exact.residual *= setting.noise_sd
        loose = with_contribution(exact, "interface_slip", np.linspace(-20, 20, N))
        gain.append(log_evidence(setting, exact) - log_evidence(setting, loose))
    assert np.all(np.mean(gain, axis=0) > 3 * np.std(gain, axis=0) / np.sqrt(len(gain)))


def with_contribution(fitted, effect, change):
    problem = SimpleNamespace(**vars(fitted.problem), model=SimpleNamespace(members=members_named([effect])))
    return SimpleNamespace(**{**vars(fitted), "effects": (effect,), "contributions": (change,), "problem": problem})


def test_the_formula_of_a_drift_errs_with_the_time_in_each_record_as_the_drift_there():
    setting = Setting.of(unit_of(amplitudes=(0.1, 0.05)), np.random.default_rng(0), BASELINE)
    places = setting.places
    size = np.where(places.record == 0, 2.0, 0.5)
    change = size * np.sign(np.sin(40.0 * places.time))
    fitted = {}
    for effect in ("thermal_drift", "interface_slip"):
        fitted[effect] = formula_error(setting, with_contribution(hypothesis(), effect, change))
    drift = fitted["thermal_drift"]
    np.testing.assert_allclose(np.sqrt(np.diag(drift)), size, rtol=1e-9)
    assert np.all(drift[places.record[:, None] != places.record] == 0.0)
    # Near in time is alike, on which leg ever; near on the loop but on another leg is not.
    first = np.flatnonzero(places.record == 0)
    later = first[np.argmin(np.abs(places.time[first] - places.time[first[0]] - 0.5))]
    correlation = drift / np.outer(size, size)
    assert correlation[first[0], first[1]] > 0.9 > 0.2 > correlation[first[0], later]
    slip = fitted["interface_slip"] / np.outer(change, change)
    assert np.any(np.abs(slip[first[0]] - correlation[first[0]])[first] > 0.3)
