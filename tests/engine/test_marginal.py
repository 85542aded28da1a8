"""Marginalisation against dense algebra: log marginal likelihood, weights, offsets, noise scale, and the mode of the scales."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag, null_space
from scipy.stats import invgamma, multivariate_normal, multivariate_t

from backdrive_bayes.engine.contrasts import BARRED, Contrasts, averaged
from backdrive_bayes.engine.contrasts import SIZES as SIZES_OF_EFFECTS
from backdrive_bayes.engine.marginal import LOG_SCALES, Scales, Whitened, _slopes, find_scales, whiten

SIZES, WEIGHTS, DOF = (30, 22), 9, 25.0
GROUP = np.repeat([0, 1, 2], 3)
FLIP = np.where(np.arange(WEIGHTS) == 1, -1.0, 1.0)


def covariance(rng, size):
    time = np.sort(rng.uniform(0, 1, size))
    return 0.3 * np.exp(-np.abs(time[:, None] - time) / 0.1) + 0.2 * np.eye(size)


@pytest.fixture(scope="module")
def problem():
    """Columns, angles and covariances of two records with offsets, nine weights in three groups."""
    rng = np.random.default_rng(4)
    columns = [rng.standard_normal((n, WEIGHTS)) for n in SIZES]
    covariances = [covariance(rng, n) for n in SIZES]
    weights = np.repeat([1.0, 0.2, 0.01], 3) * rng.standard_normal(WEIGHTS)
    noise = (np.linalg.cholesky(c) @ rng.standard_normal(n) for c, n in zip(covariances, SIZES, strict=True))
    angles = [x @ weights + e + offset for x, e, offset in zip(columns, noise, (3.0, -7.0), strict=True)]
    return columns, angles, covariances


def free_of_offsets():
    """An orthonormal basis of what no offset changes, (samples, samples - records)."""
    return null_space(block_diag(*(np.ones((1, n)) for n in SIZES)))


def dense(problem, scale):
    """Log marginal likelihood, mean and covariance by matrices of all samples (restricted likelihood)."""
    columns, angles, covariances = problem
    basis = free_of_offsets()
    x, y, c = basis.T @ np.vstack(columns), basis.T @ np.concatenate(angles), basis.T @ block_diag(*covariances) @ basis
    total = c + (x * scale**2) @ x.T
    gain = np.linalg.solve(total, x * scale**2).T
    chi2 = y @ np.linalg.solve(total, y)
    variance = (DOF + chi2) / (DOF + y.size)
    spread = variance * (np.diag(scale**2) - gain @ (x * scale**2))
    return multivariate_t.logpdf(y, None, total, DOF), gain @ y, spread


def found(problem, scale):
    columns, angles, covariances = problem
    data = whiten(columns, angles, covariances, DOF)
    return data, data.solve(scale)


CASES = [np.exp(np.array(s)[GROUP]) for s in ([0.0, -1.0, -4.0], [-2.0, 1.0, -1.0], [1.5, -6.0, 0.3])]


def test_log_marginal_likelihood_is_that_of_a_multivariate_t(problem):
    ours, theirs = [], []
    for scale in CASES:
        data, solution = found(problem, scale)
        assert solution.log_marginal == pytest.approx(data.log_marginal(scale), abs=1e-9)
        ours.append(solution.log_marginal + data.log_volume)
        theirs.append(dense(problem, scale)[0])
    np.testing.assert_allclose(np.diff(ours), np.diff(theirs), atol=1e-8)


def test_other_noise_is_compared_by_its_volume(problem):
    """The jitter is learnt by comparing covariances: the whitening's volume counts."""
    columns, angles, covariances = problem
    louder = columns, angles, [c + 0.4 * np.diag(np.linspace(0, 1, c.shape[0])) for c in covariances]
    ours, theirs, bare = [], [], []
    for case in (problem, louder):
        data, solution = found(case, CASES[0])
        ours.append(solution.log_marginal + data.log_volume)
        bare.append(solution.log_marginal)
        theirs.append(dense(case, CASES[0])[0])
    assert np.diff(ours) == pytest.approx(np.diff(theirs), abs=1e-8)
    assert abs(np.diff(bare) - np.diff(theirs)) > 1.0, "without the volume the comparison must be wrong"


@pytest.mark.parametrize("scale", CASES)
def test_weights_have_the_dense_mean_and_covariance(problem, scale):
    _, solution = found(problem, scale)
    _, mean, spread = dense(problem, scale)
    np.testing.assert_allclose(solution.mean, mean, atol=1e-10)
    np.testing.assert_allclose(solution.root @ solution.root.T * solution.variance, spread, atol=1e-12)


def test_offsets_do_not_matter_and_their_dimension_is_counted(problem):
    columns, angles, covariances = problem
    data, solution = found(problem, CASES[0])
    _, moved = found((columns, [a + s for a, s in zip(angles, (100.0, -3.0), strict=True)], covariances), CASES[0])
    np.testing.assert_allclose(moved.mean, solution.mean, atol=1e-9)
    assert data.samples == sum(SIZES) - len(SIZES)
    wrong = replace(data, samples=sum(SIZES))
    away = wrong.solve(CASES[0]).log_marginal - wrong.solve(CASES[1]).log_marginal
    right = dense(problem, CASES[0])[0] - dense(problem, CASES[1])[0]
    assert abs(away - right) > 1e-3, "offsets that cost nothing must be seen"


def test_the_noise_scale_is_integrated():
    """Against quadrature over the variance of an ordinary Gaussian."""
    rng = np.random.default_rng(1)
    x, y = rng.standard_normal((8, 3)), rng.standard_normal(8)
    data, logs = Whitened(x, y, 8, 6.0), []
    edges = np.linspace(0.0, 1.0, 4001)
    variances = invgamma(3.0, scale=3.0).ppf(0.5 * (edges[1:] + edges[:-1]))
    for scale in (np.full(3, 0.3), np.array([2.0, 0.1, 1.0])):
        total = np.eye(8) + (x * scale**2) @ x.T
        brute = np.mean([multivariate_normal.pdf(y, None, v * total) for v in variances])
        logs.append((np.log(brute), data.log_marginal(scale)))
    assert np.diff(np.array(logs)[:, 0]) == pytest.approx(np.diff(np.array(logs)[:, 1]), abs=1e-3)


def small_problem():
    rng = np.random.default_rng(9)
    x = rng.standard_normal((24, 6))
    y = x @ (np.repeat([1.0, 0.1], 3) * rng.standard_normal(6)) + rng.standard_normal(24)
    return Whitened(x, y, 24, 30.0), Scales(np.repeat([0, 1], 3), np.array([-0.5, -1.0]), np.array([1.0, 0.7]))


def test_evidence_of_two_scales_by_quadrature_is_that_of_draws_from_the_prior():
    """Nothing integrated by hand: scales, variance and weights are drawn from their priors, the likelihood is averaged."""
    data, scales = small_problem()
    nodes, share = np.polynomial.hermite_e.hermegauss(40)
    share = share / share.sum()
    points = [scales.mean + scales.sd * np.array([a, b]) for a in nodes for b in nodes]
    logs = np.array([data.log_marginal(scales.of_weights(p)) for p in points])
    constant = multivariate_t.logpdf(data.y, None, np.eye(24), 30.0) + 0.5 * 54 * np.log1p(data.total / 30.0)
    quadrature = constant + np.log(np.sum(np.outer(share, share).ravel() * np.exp(logs - logs.max()))) + logs.max()
    rng, count = np.random.default_rng(0), 400_000
    variance = 30.0 / rng.chisquare(30.0, count)
    sd = np.exp(scales.mean + scales.sd * rng.standard_normal((count, 2)))[:, scales.group]
    weights = sd * rng.standard_normal((count, 6)) * np.sqrt(variance)[:, None]
    chi2 = data.total - 2 * weights @ data.moment + np.einsum("ij,jk,ik->i", weights, data.gram, weights)
    like = -0.5 * chi2 / variance - 12 * np.log(2 * np.pi * variance)
    ratio = np.exp(like - like.max())
    error = ratio.std() / ratio.mean() / np.sqrt(count)
    assert error < 0.05
    brute = np.log(ratio.mean()) + like.max()
    assert abs(brute - quadrature) < 4 * error
    fixed = constant + data.log_marginal(scales.of_weights(scales.mean))
    assert abs(fixed - brute) > 8 * error, "scales that are not integrated must be seen"


def height(data, scales, log_scale):
    return data.log_marginal(scales.of_weights(log_scale)) + scales.log_prior(log_scale)


@pytest.mark.parametrize("start", [None, np.array([2.0, -5.0])])
def test_the_mode_of_the_scales_is_a_maximum(start):
    data, scales = small_problem()
    mode, solution = find_scales(data, scales, start)
    top = height(data, scales, mode)
    assert solution.log_marginal == pytest.approx(data.log_marginal(scales.of_weights(mode)))
    for k in range(2):
        step = 1e-4 * np.eye(2)[k]
        slope = (height(data, scales, mode + step) - height(data, scales, mode - step)) / 2e-4
        assert abs(slope) < 0.03
        assert all(height(data, scales, mode + s * np.eye(2)[k]) < top for s in (-0.2, 0.2))
    away = mode + np.array([0.5, 0.0])
    assert abs(height(data, scales, away + 1e-4) - height(data, scales, away - 1e-4)) / 2e-4 > 0.03


@pytest.mark.parametrize("log_scale", [(-0.4, -1.2), (1.0, -4.0)])
def test_slopes_of_the_density_are_those_of_difference_quotients(log_scale):
    data, scales = small_problem()
    flat, step = replace(scales, sd=np.full(2, np.inf)), 1e-3 * np.eye(2)

    def slope(at):
        ends = [height(data, flat, at + sign * step[k]) for k in range(2) for sign in (1, -1)]
        return np.array([ends[0] - ends[1], ends[2] - ends[3]]) / 2e-3

    gradient, curvature = _slopes(data.moments, scales.of_weights(np.array(log_scale)), np.array([0, 3]))
    np.testing.assert_allclose(gradient, slope(np.array(log_scale)), atol=1e-4)
    quotients = [(slope(log_scale - step[k]) - slope(log_scale + step[k])) / 2e-3 for k in range(2)]
    np.testing.assert_allclose(curvature, quotients, atol=1e-3)


def test_a_scale_that_is_pressed_against_its_range_ends_the_search_all_the_same():
    """Data that ask for scales without bound: the mode lies at the end, and the other scale is at its own maximum."""
    data, scales = small_problem()
    loud = Whitened(data.x, 1e4 * data.y, 24, 1e9)
    mode, _ = find_scales(loud, replace(scales, sd=np.full(2, 1e3)))
    assert mode.max() == LOG_SCALES[1]
    again, _ = find_scales(loud, replace(scales, sd=np.full(2, 1e3)), mode)
    np.testing.assert_allclose(again, mode, atol=0.01)


def test_a_fixed_scale_stays_where_it_is():
    data, scales = small_problem()
    fixed = Scales(scales.group, scales.mean, np.array([0.0, 0.7]))
    mode, _ = find_scales(data, fixed)
    assert mode[0] == scales.mean[0] and mode[1] != scales.mean[1]
    assert fixed.log_prior(np.array([99.0, -1.0])) == 0.0


def test_blocks_that_do_not_count_are_as_if_they_were_not_there(problem):
    """Whatever they read, correlated noise included; counted (planted fault) they move the result."""
    columns, angles, covariances = problem
    settled = [np.arange(SIZES[0]) >= 3, np.ones(SIZES[1], bool)]
    wild = [angles[0] + 100.0 * ~settled[0], angles[1]]
    data, every = whiten(columns, wild, covariances, DOF, settled), whiten(columns, wild, covariances, DOF)
    own = [np.flatnonzero(s) for s in settled]
    few = whiten(
        [c[k] for c, k in zip(columns, own, strict=True)],
        [a[k] for a, k in zip(angles, own, strict=True)],
        [c[np.ix_(k, k)] for c, k in zip(covariances, own, strict=True)],
        DOF,
    )
    for ours, theirs in ((data.gram, few.gram), (data.moment, few.moment), (data.total, few.total)):
        np.testing.assert_allclose(ours, theirs, rtol=1e-9)
    assert data.samples == few.samples == sum(SIZES) - 5 and data.log_volume == pytest.approx(few.log_volume)
    assert np.all(data.x[:3] == 0.0) and abs(every.total / few.total - 1.0) > 0.1


def test_a_weight_of_one_sign_halves_its_prior(problem):
    """The column and its mirror image share the likelihood of a weight of either sign; the sign that was planted has it all."""
    data = whiten(*problem, DOF)
    none = np.zeros((0, GROUP.size))
    contrasts = Contrasts((), GROUP, data.gram, data.moment, data.total, data.samples, data.noise_dof, none, none)
    flipped = replace(contrasts, gram=data.gram * np.outer(FLIP, FLIP), moment=data.moment * FLIP)
    scale = np.repeat([1.0, 0.2, 0.0], 3)
    both = contrasts.log_marginal(scale)
    halves = [c.log_marginal(scale, [1]) for c in (contrasts, flipped)]
    assert both == pytest.approx(data.log_marginal(np.maximum(scale, 1e-12)))
    assert np.logaddexp(*halves) - np.log(2.0) == pytest.approx(both)
    sign = np.sign(data.solve(np.maximum(scale, 1e-12)).mean[1])
    assert max(halves) == pytest.approx(both + np.log(2.0), abs=0.05) and (halves[0] > halves[1]) == (sign > 0)


def test_further_columns_weigh_as_if_they_had_been_there_and_gains_are_exact(problem):
    """The planted fault: a gain that is linear in what is explained, as at a noise that does not answer."""
    data = whiten(*problem, DOF)
    none = np.zeros((0, GROUP.size))
    contrasts = Contrasts((), GROUP, data.gram, data.moment, data.total, data.samples, data.noise_dof, none, none)
    base, size, columns = np.repeat([1.0, 0.2, 0.0], 3), np.array([0.7, 0.7, 1.4]), np.arange(6, 9)
    whole = base.copy()
    whole[columns] = size
    found = contrasts.log_marginals(base, columns, np.stack([0.0 * size, size]), [1])
    assert found == pytest.approx([contrasts.log_marginal(base, [1]), contrasts.log_marginal(whole, [1])])
    each = contrasts.log_marginals(base, columns, SIZES_OF_EFFECTS[:, None] * size)
    exact = averaged(each) - contrasts.log_marginal(base)
    assert contrasts.gains(base, columns[None], size[None]) == pytest.approx([exact])
    # What is barred is told the means of its weights, given all others.
    seen = []
    barred = contrasts.log_marginals(base, columns, size[None], barred=lambda mean: bool(seen.append(mean)) or True)
    assert barred == pytest.approx(contrasts.log_marginals(base, columns, size[None]) + BARRED)
    np.testing.assert_allclose(seen[0], data.solve(np.maximum(whole, 1e-12)).mean[columns], rtol=1e-6)
    contrasts.gains(base, columns[None], size[None], lambda mean: np.array([bool(seen.append(mean))]))
    middle = np.flatnonzero(SIZES_OF_EFFECTS == 1.0)[0]
    np.testing.assert_allclose(seen[1 + middle][0], seen[0], rtol=1e-6)
    linear = 0.5 * (data.noise_dof + data.samples) * (1.0 - contrasts.chi2(whole) / contrasts.chi2(base))
    assert abs(linear - exact) > 0.05 * abs(exact)


def test_a_group_that_is_integrated_first_weighs_as_among_the_others(problem):
    """Of all columns, of some that are joined later, and of what is left; the planted fault: what was joined holds nothing of the
    group."""
    data = whiten(*problem, DOF)
    names, scale, size = ("class", "group", "more"), np.repeat([1.0, 0.2, 0.0], 3), np.array([[0.7, 0.7, 1.4]])

    def made(own):
        x = data.x[:, own]
        gram, moment, none = data.gram[np.ix_(own, own)], data.moment[own], np.zeros((0, len(own)))
        index = np.unique(GROUP[own], return_inverse=True)[1]
        some = tuple(names[g] for g in np.unique(GROUP[own]))
        return Contrasts(some, index, gram, moment, data.total, data.samples, data.noise_dof, x, none)

    whole, few, more = made(np.arange(9)), made(np.arange(6)), made(np.arange(6, 9))
    beside = few.beside("group", 0.2)
    exact = whole.log_marginals(scale, np.arange(6, 9), size, [1])
    joined = beside.joined(3, more)
    assert joined.log_marginals(np.repeat([1.0, 0.0], 3), np.arange(3, 6), size, [1]) == pytest.approx(exact)
    alike = whole.beside("group", 0.2)
    assert alike.log_marginals(np.repeat([1.0, 0.0], 3), np.arange(3, 6), size, [1]) == pytest.approx(exact)
    assert beside.chi2(np.ones(3)) == pytest.approx(few.chi2(scale[:6]))
    apart = replace(beside, integrated=replace(beside.integrated, scale=0.0)).joined(3, more)
    assert abs(apart.log_marginals(np.repeat([1.0, 0.0], 3), np.arange(3, 6), size, [1]) - exact) > 0.01


def test_held_weights_and_the_data_have_the_dense_joint_density(problem):
    """Of both the data and the held weights, up to a constant: by a multivariate t of everything that is seen."""
    columns, angles, covariances = problem
    held, scale = np.isin(np.arange(WEIGHTS), [1, 4]), CASES[0]
    data, basis = whiten(columns, angles, covariances, DOF), free_of_offsets()
    x, y, c = basis.T @ np.vstack(columns), basis.T @ np.concatenate(angles), basis.T @ block_diag(*covariances) @ basis
    across = x[:, held] * scale[held] ** 2
    joint = np.block([[c + (x * scale**2) @ x.T, across], [across.T, np.diag(scale[held] ** 2)]])

    def both(values):
        moments = data.moments.holding(values, held, scale)
        return multivariate_t.logpdf(np.r_[y, values[held]], None, joint, DOF), moments.log_marginal(scale[~held])

    some, other = (np.linspace(a, b, WEIGHTS) for a, b in ((-1.0, 2.0), (0.4, -0.7)))
    dense, found = np.subtract(both(some), both(other))
    assert found == pytest.approx(dense) and abs(found) > 1.0
