"""GPy: GPRegression with a bias, a linear, an RBF and a second linear kernel on the signs."""

import time

import GPy
import numpy as np

from samples import N_JOINTS, is_full, with_signs

PACKAGES = ("GPy", "numpy")
# Exact inference of GPy adds this to the diagonal beside the noise; taken off the noise it is given.
ADDED_TO_NOISE = 1e-8


def build(x, targets, at):
    d = x.shape[1]
    kernel = GPy.kern.Bias(d) + GPy.kern.RBF(d, ARD=True, active_dims=range(d))
    if is_full(at):
        kernel = (
            GPy.kern.Bias(d + N_JOINTS, active_dims=range(d + N_JOINTS))
            + GPy.kern.RBF(d, ARD=True, active_dims=range(d))
            + GPy.kern.Linear(d, ARD=True, active_dims=range(d))
            + GPy.kern.Linear(N_JOINTS, ARD=True, active_dims=range(d, d + N_JOINTS))
        )
    model = GPy.models.GPRegression(with_signs(x, at), targets[:, None], kernel)

    def evaluate(at):
        values = natural(at)
        clock = time.perf_counter()
        model[:] = values
        value, of_natural = model.log_likelihood(), model.gradient.copy()
        seconds = time.perf_counter() - clock
        return seconds, value, by_name(of_natural, at, d)

    return evaluate


def natural(at):
    """GPy's own order: variances of the kernels in turn, length scales after the RBF's variance, noise last."""
    parts = [at["bias_std"] ** 2, at["signal_std"] ** 2, at["length_scales"]]
    if is_full(at):
        parts += [at["linear_std"] ** 2, at["coulomb_std"] ** 2]
    return np.hstack([*parts, at["noise_std"] ** 2 - ADDED_TO_NOISE])


def by_name(gradient, at, d):
    """From variances to standard deviations: dL/ds = 2 s dL/ds²."""
    named = {
        "bias_std": 2.0 * at["bias_std"] * gradient[:1],
        "signal_std": 2.0 * at["signal_std"] * gradient[1:2],
        "length_scales": gradient[2 : d + 2],
        "noise_std": 2.0 * at["noise_std"] * gradient[-1:],
    }
    if is_full(at):
        named["linear_std"] = 2.0 * at["linear_std"] * gradient[d + 2 : 2 * d + 2]
        named["coulomb_std"] = 2.0 * at["coulomb_std"] * gradient[2 * d + 2 : -1]
    return named
