"""GPy: GPRegression with a bias, a linear, an RBF and a second linear kernel on the signs; of several loads, their
sum times a kernel of the loads (its intrinsic coregionalisation model).
"""

import time

import GPy
import numpy as np

from samples import N_JOINTS, is_full, with_signs

PACKAGES = ("GPy", "numpy")
# Exact inference of GPy adds this to the diagonal beside the noise; taken off the noise it is given.
ADDED_TO_NOISE = 1e-8


def build(x, targets, at):
    d = 3 * N_JOINTS
    kernel = GPy.kern.Bias(d) + GPy.kern.RBF(d, ARD=True, active_dims=range(d))
    if is_full(at):
        kernel = (
            GPy.kern.Bias(d + N_JOINTS, active_dims=range(d + N_JOINTS))
            + GPy.kern.RBF(d, ARD=True, active_dims=range(d))
            + GPy.kern.Linear(d, ARD=True, active_dims=range(d))
            + GPy.kern.Linear(N_JOINTS, ARD=True, active_dims=range(d, d + N_JOINTS))
        )
    if "task_factor" in at:
        n_tasks, rank = at["task_factor"].shape
        kernel = GPy.util.multioutput.ICM(d + N_JOINTS, n_tasks, kernel, W_rank=rank)
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
    """GPy's own order: variances of the kernels in turn, length scales after the RBF's variance, noise last.

    Before it W = Λ of several loads and kappa, what GPy adds to the diagonal of WWᵀ and our model does not have.
    """
    parts = [at["bias_std"] ** 2, at["signal_std"] ** 2, at["length_scales"]]
    if is_full(at):
        parts += [at["linear_std"] ** 2, at["coulomb_std"] ** 2]
    if "task_factor" in at:
        parts += [at["task_factor"].ravel(), np.zeros(len(at["task_factor"]))]
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
        of_signs = slice(2 * d + 2, 2 * d + 2 + N_JOINTS)
        named["coulomb_std"] = 2.0 * at["coulomb_std"] * gradient[of_signs]
    if "task_factor" in at:
        shape = at["task_factor"].shape
        of_factor = gradient[of_signs.stop : of_signs.stop + shape[0] * shape[1]].reshape(shape)
        # The free entries, row by row.
        named["task_factor"] = of_factor[np.tril_indices(*shape[:1], m=shape[1])]
    return named
