"""Samples and hyperparameters as every contestant in Python receives them."""

import csv
import tomllib

import numpy as np

N_JOINTS = 6
NAMES = ("bias_std", "linear_std", "signal_std", "length_scales", "coulomb_std", "noise_std", "task_factor")


def read_samples(path, n):
    """The first n rows: (n, 18) covariates q, qd, qdd and (n,) torques; the task is a 19th covariate of several loads."""
    with open(path, newline="") as file:
        rows = csv.reader(file)
        width = len(next(rows))
        table = np.array([[float(cell) for cell in row] for row, _ in zip(rows, range(n))])
    if table.shape != (n, width) or width not in (3 * N_JOINTS + 1, 3 * N_JOINTS + 2):
        raise ValueError(f"{path} holds {table.shape}, not {(n, 3 * N_JOINTS + 1)}")
    return np.delete(table, 3 * N_JOINTS, axis=1), np.ascontiguousarray(table[:, 3 * N_JOINTS])


def read_hyperparameters(path):
    """Arrays by name; without linear_std the model is bias + squared exponential."""
    with open(path, "rb") as file:
        values = tomllib.load(file)
    return {name: np.atleast_1d(np.asarray(values[name], float)) for name in NAMES if name in values}


def shifted(at, shift):
    """Every hyperparameter multiplied by 1 + shift."""
    return {name: (1.0 + shift) * values for name, values in at.items()}


def is_full(at):
    """Whether the linear and the Coulomb term are there."""
    return "linear_std" in at


def with_signs(x, at):
    """The covariates, followed by the signs of the velocities if the model needs them, and by the task if there is one."""
    if not is_full(at):
        return x
    d = 3 * N_JOINTS
    return np.hstack([x[:, :d], np.sign(x[:, N_JOINTS : 2 * N_JOINTS]), x[:, d:]])
