"""scikit-learn: constant · RBF + constant + white, the part of the model that it can express.

Its DotProduct kernel has one weight for all covariates. It stores ∂K/∂θ for every hyperparameter.
"""

import time
import warnings

import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel, WhiteKernel

from samples import is_full

PACKAGES = ("scikit-learn", "numpy")
BOUNDS = (1e-12, 1e12)


def build(x, targets, at):
    if is_full(at):
        raise ValueError("scikit-learn has no linear kernel with a weight per covariate")
    kernel = (
        ConstantKernel(at["signal_std"][0] ** 2, BOUNDS) * RBF(at["length_scales"], BOUNDS)
        + ConstantKernel(at["bias_std"][0] ** 2, BOUNDS)
        + WhiteKernel(at["noise_std"][0] ** 2, BOUNDS)
    )
    # Without an optimiser, `fit` stores the data and factorises once.
    model = GaussianProcessRegressor(kernel, alpha=0.0, optimizer=None)
    warnings.simplefilter("ignore")
    model.fit(x, targets)

    def evaluate(at):
        log_squares = [2.0 * np.log(at[name]) for name in ("signal_std", "bias_std", "noise_std")]
        theta = np.hstack([log_squares[0], np.log(at["length_scales"]), *log_squares[1:]])
        clock = time.perf_counter()
        value, gradient = model.log_marginal_likelihood(theta, eval_gradient=True, clone_kernel=False)
        seconds = time.perf_counter() - clock
        d = len(at["length_scales"])
        named = {
            "signal_std": 2.0 / at["signal_std"] * gradient[:1],
            "length_scales": gradient[1 : d + 1] / at["length_scales"],
            "bias_std": 2.0 / at["bias_std"] * gradient[d + 1 : d + 2],
            "noise_std": 2.0 / at["noise_std"] * gradient[d + 2 :],
        }
        return seconds, value, named

    return evaluate
