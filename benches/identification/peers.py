"""The least squares of an arm's parameters by this project and by Pinocchio with numpy, in alternating rounds of one run.

    cargo build --release -p cli
    python peers.py --rounds 5

Run it by hand with an interpreter that has numpy and pin (PyPI). It draws a log of the PUMA 560 under three loads, 10,000
rows of six joints, and times on one thread each

    torque-gp    fit --model rbd --friction-terms standard, the whole program: reading the log, five passes with
                 noise and correlation, a posterior of parameters and its prediction, writing the model
    Pinocchio    one pass: computeJointTorqueRegressor row by row, the friction columns by numpy, AᵀA and Aᵀy
                 and their solution; the log is in memory

and prints medians, the ratio, and how far apart the torques of both solutions are.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

import numpy as np  # noqa: E402
import pinocchio as pin  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
URDF = ROOT / "fixtures" / "puma560.urdf"
STEP = 0.01  # s
SEED = 1
LENGTH = 5e-4  # rad, of the hysteresis


class Arm:
    """Pinocchio's PUMA; a continuous joint is (cos q, sin q) to it."""

    def __init__(self):
        self.model = pin.buildModelFromUrdf(str(URDF))
        self.data = self.model.createData()
        self.dof = self.model.nv

    def configuration(self, q):
        out = np.empty(self.model.nq)
        for joint in self.model.joints[1:]:
            value = q[joint.idx_v]
            out[joint.idx_q : joint.idx_q + joint.nq] = (np.cos(value), np.sin(value)) if joint.nq == 2 else value
        return out

    def regressor(self, q, qd, qdd):
        return pin.computeJointTorqueRegressor(self.model, self.data, self.configuration(q), qd, qdd)

    def parameters(self):
        return np.concatenate([inertia.toDynamicParameters() for inertia in list(self.model.inertias)[1:]])


def motion(rng, n, dof):
    t = STEP * np.arange(n)
    rate, size = rng.uniform(0.5, 4, (dof, 3)), rng.uniform(0.1, 0.5, (dof, 3))
    phase = rate * t[:, None, None] + rng.uniform(0, 2 * np.pi, (dof, 3))
    q = (size * np.sin(phase)).sum(2)
    return t, q, (size * rate * np.cos(phase)).sum(2), -(size * rate**2 * np.sin(phase)).sum(2)


def memory(qd, step):
    """z of each joint: s + (z - s) exp(-|qd| step / length), row after row."""
    z = np.zeros_like(qd)
    for row in range(1, len(qd)):
        s = np.sign(qd[row])
        z[row] = s + (z[row - 1] - s) * np.exp(-np.abs(qd[row]) * step / LENGTH)
    return z


def friction(qd, qdd, z, rigid):
    """The columns of the standard set, (joint, row, term)."""
    one = np.ones_like(qd)
    load = np.abs(rigid)
    columns = [qdd, qd, one, np.tanh(qd / 0.02), np.tanh(qd / 0.3), z, load * z, load * qd]
    return np.stack(columns, axis=-1).transpose(1, 0, 2)


class Log:
    """Runs of three loads, the first of which is none."""

    def __init__(self, arm, rows, n_runs):
        rng = np.random.default_rng(SEED)
        loads = [np.zeros(10)]
        for mass, z in ((1.0, 0.08), (2.5, 0.1)):
            spread = mass * 0.01
            loads.append(np.array([mass, 0, 0, mass * z, spread, 0, spread, 0, 0, spread]))
        self.runs = []
        for run in range(n_runs):
            t, q, qd, qdd = motion(rng, rows // n_runs, arm.dof)
            parameters = arm.parameters()
            parameters[-10:] += loads[run % 3]
            rigid = np.array([arm.regressor(*state) @ parameters for state in zip(q, qd, qdd)])
            columns = friction(qd, qdd, memory(qd, STEP), rigid)
            theta = np.array([1.0, 3.0, 0.1, 2.0, 0.5, 1.0, 0.03, 0.02])
            tau = rigid + (columns @ theta).T + 0.1 * rng.standard_normal(qd.shape)
            self.runs.append((run % 3, t, q, qd, qdd, tau))

    def write(self, path):
        stems = ("q", "qd", "qdd", "tau")
        names = [f"{stem}_joint{j + 1}" for stem in stems for j in range(6)]
        with open(path, "w") as file:
            file.write(",".join(["context", "run", "t", *names]) + "\n")
            for number, (load, t, *columns) in enumerate(self.runs):
                for time_of, row in zip(t, np.hstack(columns)):
                    numbers = ",".join(repr(float(value)) for value in row)
                    file.write(f"load{load},run{number},{float(time_of)!r},{numbers}\n")


def solve(arm, log):
    """Normal equations of all joints together with a ridge, and their solution: what the other program does five times."""
    bodies, terms = 10 * arm.dof, 8
    p = bodies + arm.dof * terms + 20
    described = arm.parameters()
    h, b = 1e-9 * np.eye(p), np.zeros(p)
    for load, _, q, qd, qdd, tau in log.runs:
        y = np.array([arm.regressor(*state) for state in zip(q, qd, qdd)])  # (row, joint, bodies)
        rigid = y @ described
        phi = friction(qd, qdd, memory(qd, STEP), rigid)
        for joint in range(arm.dof):
            a = np.zeros((len(q), p))
            a[:, :bodies] = y[:, joint]
            a[:, bodies + joint * terms : bodies + (joint + 1) * terms] = phi[joint]
            if load > 0:
                first = bodies + arm.dof * terms + 10 * (load - 1)
                a[:, first : first + 10] = y[:, joint, bodies - 10 :]
            h += a.T @ a
            b += a.T @ (tau[:, joint] - rigid[:, joint])
    return np.linalg.solve(h, b)


def rms_error(arm, log, w):
    """Of the solution's torques, as a check that it is one."""
    bodies, terms = 10 * arm.dof, 8
    squares, n = 0.0, 0
    for load, _, q, qd, qdd, tau in log.runs[:3]:
        y = np.array([arm.regressor(*state) for state in zip(q, qd, qdd)])
        parameters = np.array(w[:bodies])
        if load > 0:
            first = bodies + arm.dof * terms + 10 * (load - 1)
            parameters[-10:] += w[first : first + 10]
        rigid = y @ arm.parameters()
        phi = friction(qd, qdd, memory(qd, STEP), rigid)
        of_friction = [phi[j] @ w[bodies + j * terms : bodies + (j + 1) * terms] for j in range(arm.dof)]
        error = tau - rigid - y @ parameters - np.stack(of_friction, axis=1)
        squares, n = squares + (error**2).sum(), n + error.size
    return (squares / n) ** 0.5


def main():
    arguments = argparse.ArgumentParser()
    arguments.add_argument("--rows", type=int, default=10_000)
    arguments.add_argument("--rounds", type=int, default=5)
    arguments.add_argument("--command", default=str(ROOT / "target" / "release" / "torque-gp"))
    given = arguments.parse_args()
    arm = Arm()
    log = Log(arm, given.rows, 9)
    with tempfile.TemporaryDirectory() as folder:
        data, model = Path(folder) / "log.csv", Path(folder) / "arm.tgp"
        log.write(data)
        command = f"{given.command} fit --model rbd --friction-terms standard --bare load0 --threads 1"
        command = [*command.split(), "--robot", str(URDF), "--data", str(data), "--output", str(model)]
        ours, theirs = [], []
        for _ in range(given.rounds):
            start = time.perf_counter()
            done = subprocess.run(command, capture_output=True, text=True)
            ours.append(time.perf_counter() - start)
            if done.returncode:
                sys.exit(done.stderr)
            start = time.perf_counter()
            w = solve(arm, log)
            theirs.append(time.perf_counter() - start)
    error = rms_error(arm, log, w)
    assert error < 0.2, error  # N m; the noise has 0.1
    a, b = statistics.median(ours), statistics.median(theirs)
    rows = sum(len(run[1]) for run in log.runs)
    print(f"{rows} rows, {given.rounds} rounds; Pinocchio {pin.__version__}, numpy {np.__version__}, rms error {error:.3f} N m")
    print(f"torque-gp, five passes and all: {a:.3f} s ({min(ours):.3f} to {max(ours):.3f})")
    print(f"Pinocchio and numpy, one pass:  {b:.3f} s ({min(theirs):.3f} to {max(theirs):.3f})")
    print(f"ratio {b / a:.2f}")


if __name__ == "__main__":
    main()
