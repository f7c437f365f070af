"""GPflow: GPR with a compiled tf.function for value and gradient."""

import os
import time

os.environ.setdefault("TF_CPP_MIN_LOG_LEVEL", "2")
os.environ.setdefault("TF_USE_LEGACY_KERAS", "1")

import gpflow  # noqa: E402  (the environment comes first)
import tensorflow as tf  # noqa: E402

from samples import N_JOINTS, is_full, with_signs  # noqa: E402

PACKAGES = ("gpflow", "tensorflow")


def build(x, targets, at):
    threads = int(os.environ["OMP_NUM_THREADS"])
    tf.config.threading.set_intra_op_parallelism_threads(threads)
    tf.config.threading.set_inter_op_parallelism_threads(threads)
    # θ = eʳ for every positive parameter, and no floor under the noise.
    gpflow.config.set_default_positive_bijector("exp")
    gpflow.config.set_default_positive_minimum(0.0)
    d = x.shape[1]
    kernels = gpflow.kernels
    bias = kernels.Constant()
    smooth = kernels.SquaredExponential(lengthscales=[1.0] * d, active_dims=list(range(d)))
    kernel = bias + smooth
    likelihood = gpflow.likelihoods.Gaussian(variance=1.0, variance_lower_bound=0.0)
    parameters = {
        "bias_std": (bias.variance, 2),
        "signal_std": (smooth.variance, 2),
        "length_scales": (smooth.lengthscales, 1),
        "noise_std": (likelihood.variance, 2),
    }
    if is_full(at):
        linear = kernels.Linear(variance=[1.0] * d, active_dims=list(range(d)))
        friction = kernels.Linear(variance=[1.0] * N_JOINTS, active_dims=list(range(d, d + N_JOINTS)))
        kernel = kernel + linear + friction
        parameters |= {"linear_std": (linear.variance, 2), "coulomb_std": (friction.variance, 2)}
    model = gpflow.models.GPR((with_signs(x, at), targets[:, None]), kernel, likelihood=likelihood)
    raw = [parameter.unconstrained_variable for parameter, _ in parameters.values()]

    @tf.function
    def value_and_gradient():
        with tf.GradientTape() as tape:
            value = model.log_marginal_likelihood()
        return value, tape.gradient(value, raw)

    def evaluate(at):
        for name, (parameter, power) in parameters.items():
            values = at[name] ** power
            parameter.assign(values.reshape(parameter.shape))
        clock = time.perf_counter()
        value, gradient = value_and_gradient()
        value, gradient = value.numpy(), [g.numpy() for g in gradient]
        seconds = time.perf_counter() - clock
        # dL/dθ = power/θ dL/dr with r = power log θ.
        named = {
            name: power / at[name] * g.reshape(-1)
            for (name, (_, power)), g in zip(parameters.items(), gradient, strict=True)
        }
        return seconds, value, named

    return evaluate
