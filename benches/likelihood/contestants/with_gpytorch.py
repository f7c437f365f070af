"""GPyTorch: an exact model in float64, by Cholesky, with gradients by automatic differentiation.

The kernels are added as dense matrices: the sum of kernel objects is slower by half, since adding a lazy linear
kernel makes linear_operator factorise the other summand first.
"""

import os
import time

import gpytorch
import torch
from linear_operator import to_linear_operator

from samples import N_JOINTS, is_full, with_signs

PACKAGES = ("gpytorch", "torch")


class Model(gpytorch.models.ExactGP):
    def __init__(self, x, targets, likelihood, is_full, d):
        super().__init__(x, targets, likelihood)
        kernels = gpytorch.kernels
        self.mean_module = gpytorch.means.ZeroMean()
        self.bias = kernels.ConstantKernel()
        self.smooth = kernels.ScaleKernel(kernels.RBFKernel(ard_num_dims=d, active_dims=tuple(range(d))))
        self.kernels = torch.nn.ModuleList([self.bias, self.smooth])
        if is_full:
            self.linear = kernels.LinearKernel(ard_num_dims=d, active_dims=tuple(range(d)))
            self.friction = kernels.LinearKernel(ard_num_dims=N_JOINTS, active_dims=tuple(range(d, d + N_JOINTS)))
            self.kernels.extend([self.linear, self.friction])

    def forward(self, x):
        covariance = sum(kernel(x).to_dense() for kernel in self.kernels)
        return gpytorch.distributions.MultivariateNormal(self.mean_module(x), to_linear_operator(covariance))


def build(x, targets, at):
    torch.set_default_dtype(torch.float64)
    torch.set_num_threads(int(os.environ["OMP_NUM_THREADS"]))
    n, d = x.shape
    x, targets = torch.as_tensor(with_signs(x, at)), torch.as_tensor(targets)
    likelihood = gpytorch.likelihoods.GaussianLikelihood(noise_constraint=gpytorch.constraints.Positive())
    model = Model(x, targets, likelihood, is_full(at), d)
    model.train()
    likelihood.train()
    density = gpytorch.mlls.ExactMarginalLogLikelihood(likelihood, model)
    parameters = named_parameters(model, likelihood, is_full(at))

    def evaluate(at):
        for name, (module, attribute, power) in parameters.items():
            setattr(module, attribute, torch.as_tensor(at[name] ** power))
        model.zero_grad(set_to_none=True)
        clock = time.perf_counter()
        with gpytorch.settings.fast_computations(covar_root_decomposition=False, log_prob=False, solves=False):
            value = n * density(model(x), targets)  # GPyTorch's is per sample
        value.backward()
        seconds = time.perf_counter() - clock
        return seconds, value.item(), by_name(parameters, at)

    return evaluate


def named_parameters(model, likelihood, is_full):
    """Module, attribute and power of a standard deviation behind each hyperparameter."""
    parameters = {
        "bias_std": (model.bias, "constant", 2),
        "signal_std": (model.smooth, "outputscale", 2),
        "length_scales": (model.smooth.base_kernel, "lengthscale", 1),
        "noise_std": (likelihood.noise_covar, "noise", 2),
    }
    if is_full:
        parameters["linear_std"] = (model.linear, "variance", 2)
        parameters["coulomb_std"] = (model.friction, "variance", 2)
    return parameters


def by_name(parameters, at):
    """From the raw parameters r to natural ones: dL/dθ = dL/dr / (dp/dr) · dp/dθ with p = θ^power."""
    named = {}
    for name, (module, attribute, power) in parameters.items():
        raw = getattr(module, f"raw_{attribute}")
        variable = raw.detach().clone().requires_grad_()
        constraint = getattr(module, f"raw_{attribute}_constraint")
        (slope,) = torch.autograd.grad(constraint.transform(variable).sum(), variable)
        of_power = (raw.grad / slope).reshape(-1).numpy()
        named[name] = of_power * power * at[name] ** (power - 1)
    return named
