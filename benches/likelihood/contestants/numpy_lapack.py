"""The honest baseline: numpy and LAPACK, n³ flops in place, gradients without any ∂K/∂θ.

    K = F F' + v² exp(−½ s) + σ² I,    F = (b, u_j x_j, w_j sgn qd_j)
    potrf, potrs, potri;    P = K⁻¹ − αα';    ∂L/∂θ = −½ tr(P ∂K/∂θ)

Matrices are column-major with the lower triangle in use, in blocks of columns that fit the cache; the two of
them are allocated once. All gradients of the finite-rank part come from one product P F, those of the length
scales from one product (P∘K_SE)(1, z).
"""

import time

import numpy as np
from scipy.linalg import blas, lapack

from samples import N_JOINTS, is_full

PACKAGES = ("numpy", "scipy")
BLOCK = 256


def build(x, targets, at):
    n = len(targets)
    k, k_se = np.zeros((n, n), order="F"), np.zeros((n, n), order="F")
    centred = x - x.mean(axis=0)
    signs = np.sign(x[:, N_JOINTS : 2 * N_JOINTS])
    ones = np.ones((n, 1))
    basis = np.asfortranarray(np.hstack([ones, x, signs]) if is_full(at) else ones)

    def evaluate(at):
        clock = time.perf_counter()
        value, gradient = likelihood(k, k_se, centred, basis, targets, at)
        return time.perf_counter() - clock, value, gradient

    return evaluate


def likelihood(k, k_se, centred, basis, targets, at):
    """Value and gradient of eq. (8); overwrites k and k_se."""
    n = len(targets)
    bias, signal, noise = (at[name][0] for name in ("bias_std", "signal_std", "noise_std"))
    weights = np.hstack([at["bias_std"], at.get("linear_std", []), at.get("coulomb_std", [])])
    z = np.asfortranarray(centred / at["length_scales"])
    fill(k, k_se, z, basis * weights, signal**2)
    k[np.diag_indices(n)] += noise**2

    factor, info = lapack.dpotrf(k, lower=1, overwrite_a=1, clean=0)
    if info != 0:
        raise ArithmeticError(f"not positive definite at pivot {info}")
    alpha, _ = lapack.dpotrs(factor, targets, lower=1)
    log_det = 2.0 * np.log(factor.diagonal()).sum()
    value = -0.5 * (targets @ alpha + log_det + n * np.log(2.0 * np.pi))

    inverse, _ = lapack.dpotri(factor, lower=1, overwrite_c=1)
    p = blas.dsyr(-1.0, alpha, lower=1, a=inverse, overwrite_a=1)  # K⁻¹ − αα', lower
    of_weights = -weights * np.einsum("ij,ij->j", basis, blas.dsymm(1.0, p, basis, lower=1))
    of_noise = -noise * p.diagonal().sum()
    weigh(k_se, p)
    of_signal, of_scales = of_squared_exponential(k_se, z, signal, at["length_scales"])
    gradient = {
        "bias_std": of_weights[:1],
        "signal_std": [of_signal],
        "length_scales": of_scales,
        "noise_std": [of_noise],
    }
    if len(weights) > 1:
        d = z.shape[1]
        gradient |= {"linear_std": of_weights[1 : d + 1], "coulomb_std": of_weights[d + 1 :]}
    return value, gradient


def fill(k, k_se, z, features, signal_var):
    """Lower triangles of v² exp(−½ s) and of F F' + v² exp(−½ s), block column by block column."""
    n = len(z)
    half_norms = 0.5 * np.einsum("ij,ij->i", z, z)
    for start in range(0, n, BLOCK):
        stop = min(start + BLOCK, n)
        block = blas.dgemm(1.0, z[start:], z[start:stop], trans_b=1)
        block -= half_norms[start:, None]
        block -= half_norms[start:stop]
        np.minimum(block, 0.0, out=block)
        np.exp(block, out=block)
        block *= signal_var
        k_se[start:, start:stop] = block
        block = blas.dgemm(1.0, features[start:], features[start:stop], trans_b=1, beta=1.0, c=block, overwrite_c=1)
        k[start:, start:stop] = block


def weigh(k_se, p):
    """K_SE becomes P∘K_SE in the lower triangle."""
    n = len(p)
    for start in range(0, n, BLOCK):
        k_se[start:, start : start + BLOCK] *= p[start:, start : start + BLOCK]


def of_squared_exponential(weighted, z, signal, length_scales):
    """∂L/∂v = −ΣM/v and ∂L/∂l_j = −½ ΣM_ab (z_aj − z_bj)²/l_j with M = P∘K_SE."""
    rows = np.asfortranarray(np.hstack([np.ones((len(z), 1)), z]))
    products = blas.dsymm(1.0, weighted, rows, lower=1)
    sums = products[:, 0]
    squares = np.einsum("i,ij,ij->j", sums, z, z) - np.einsum("ij,ij->j", z, products[:, 1:])
    return -sums.sum() / signal, -squares / length_scales
