"""One likelihood with gradient by this project and by others, in alternating rounds of one run.

    python peers.py --n 4000 --rounds 7 --threads 2

Run it by hand with an interpreter that has numpy, scipy, GPy, gpytorch, gpflow and scikit-learn; a
package that is missing is skipped with one line. It builds the Rust program beside it, lets it draw the data,
starts every contestant in a process of its own, refuses to time before all of them agree, and prints
a table of medians and ratios.

Three models: `full` is eq. (7) with 45 hyperparameters; `smooth` is bias + squared exponential + noise with
20, all that scikit-learn and gprx can express, on the torques of an arm without friction; `loads` is eq. (16) of
rank 4 for 14 loads with 95, of each joint in turn, which only GPy can express. Every evaluation has
hyperparameters of its own: in round r all are multiplied by 1 + shift(r), the same for everybody.
"""

import argparse
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
PEERS = {"GPy": "with_gpy", "GPyTorch": "with_gpytorch", "GPflow": "with_gpflow", "scikit-learn": "with_sklearn"}
LAPACK = "numpy + LAPACK"
DENSE = "torque-gp, dense"
# A value may differ by rounding: 1e-8 relative; a gradient by 1e-6 of its largest entry per unit of log θ.
# Covariances of several loads reach 3·10⁴ beside a noise of 10⁻⁴, and their rounding 2·10⁻¹⁶ of that in each entry:
# the gradients of three programs then differ by some 10⁻⁶ among each other.
VALUE_TOLERANCE, GRADIENT_TOLERANCE = 1e-8, {"full": 1e-6, "smooth": 1e-6, "loads": 1e-5}
# Fast contestants have more turns a round, so that their median rests on more than a few milliseconds.
FAST_TURNS = 20
# scikit-learn needs 360 bytes per entry of K (measured: 5.8 GB at n = 4000).
SKLEARN_BYTES = 360


class Case:
    """A model with its data and hyperparameters."""

    def __init__(self, model, joint):
        self.model = model
        self.title = f"loads, joint {joint}" if model == "loads" else model
        files = {"full": "joint3.toml", "smooth": "joint3-smooth.toml", "loads": f"loads/joint{joint}.toml"}
        self.hyperparameters = HERE / files[model]
        arguments = {"full": ["--load", "c2"], "smooth": ["--load", "c2", "--frictionless"], "loads": ["--loads", "14"]}
        self.data = [*arguments[model], "--joint", str(joint)]

    @staticmethod
    def all(options):
        joints = options.joints.split(",")
        for model in options.models.split(","):
            yield from (Case(model, joint) for joint in (joints if model == "loads" else [3]))

    def peers(self):
        """Those that can express the model, as modules by name."""
        return {"GPy": PEERS["GPy"]} if self.model == "loads" else {LAPACK: "numpy_lapack"} | PEERS


class Contestant:
    """A process that answers shifts with evaluations."""

    def __init__(self, name, command, environment, request="{shift!r}", turns=1):
        self.name, self.request, self.turns = name, request, turns
        self.seconds, self.versions, self.last = [], {}, None
        self.complaints = tempfile.TemporaryFile("w+")
        self.process = subprocess.Popen(
            command, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.complaints, text=True
        )

    def evaluate(self, shift):
        self.process.stdin.write(self.request.format(shift=shift) + "\n")
        self.process.stdin.flush()
        self.last = self.read()
        return self.last

    def read(self):
        line = self.process.stdout.readline()
        if not line:
            self.complaints.seek(0)
            raise RuntimeError(f"{self.name}: {self.complaints.read()[-2000:]}")
        return json.loads(line)

    def stop(self):
        self.process.stdin.close()
        self.process.wait()


def shift(turn):
    """Within 1 %, different in consecutive turns."""
    return 0.001 * ((7 * turn) % 21 - 10)


def environment(threads):
    """Threads of every library, and the kernels that OpenBLAS would not choose on a new AMD processor."""
    counts = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "RAYON_NUM_THREADS")
    found = os.environ | {name: str(threads) for name in counts}
    if " avx512f " in cpu_info():
        found.setdefault("OPENBLAS_CORETYPE", "SkylakeX")
    return found | {"CUDA_VISIBLE_DEVICES": ""}


def cpu_info():
    path = Path("/proc/cpuinfo")
    return path.read_text() if path.exists() else ""


def build_program():
    command = ["cargo", "build", "--release", "--manifest-path", HERE / "Cargo.toml", "--message-format", "json"]
    lines = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout.splitlines()
    built = [json.loads(line).get("executable") for line in lines]
    return next(path for path in built if path)


def start(case, program, data, options):
    """Every contestant that can express the model."""
    hyperparameters = case.hyperparameters
    variables = environment(options.threads)
    serve = [program, "serve", "--data", data, "--hyperparameters", hyperparameters, "--n", str(options.n)]
    contestants = [Contestant(DENSE, serve, variables, "dense {shift!r}")]
    for bound in ("1e0", "1e-1") if case.model == "loads" else ("1e-2", "1e-4"):
        for kind, note in (("certified", "from nothing"), ("warm", "as in a fit")):
            name = f"torque-gp, certified to {bound}, {note}"
            turns = 1 if case.model == "loads" else FAST_TURNS
            contestants.append(Contestant(name, serve, variables, f"{kind} {bound} {{shift!r}}", turns))
    for name, module in case.peers().items():
        if reason := why_not(name, options):
            print(f"{name}: skipped, {reason}")
            continue
        worker = [sys.executable, HERE / "contestants" / "worker.py", module, data, hyperparameters, str(options.n)]
        contestant = Contestant(name, worker, variables)
        greeting = contestant.read()
        if "skipped" in greeting:
            print(f"{name}: skipped, {greeting['skipped']}")
            continue
        contestant.versions = greeting["versions"]
        contestants.append(contestant)
    if case.model == "smooth" and not why_not("gprx", options):
        contestants.append(Contestant("gprx", serve, variables, "gprx {shift!r}"))
    return contestants


def why_not(name, options):
    if options.only and name not in options.only.split(","):
        return "not asked for"
    if name == "scikit-learn" and available_memory() < SKLEARN_BYTES * options.n**2:
        return f"it needs {SKLEARN_BYTES * options.n**2 / 1e9:.1f} GB of memory"
    return None


def available_memory():
    lines = Path("/proc/meminfo").read_text().splitlines()
    return next(1024 * int(line.split()[1]) for line in lines if line.startswith("MemAvailable"))


def check_agreement(case, contestants):
    """Value and gradient of everybody against the dense path; raises where one differs."""
    hyperparameters = tomllib.loads(case.hyperparameters.read_text())
    reference = contestants[0].evaluate(0.0)
    for contestant in contestants[1:]:
        found = contestant.evaluate(0.0)
        value, of_value = found["value"], reference["value"]
        allowed = VALUE_TOLERANCE * abs(of_value)
        is_certified = "certified" in contestant.name
        if is_certified:
            allowed += found["error_bound"]
        worst = gradient_difference(found["gradient"], reference["gradient"], hyperparameters)
        print(f"{contestant.name:<44} value {value:.6f}, off by {value - of_value:+.1e}; gradient {worst:.1e}")
        if abs(value - of_value) > allowed:
            raise AssertionError(f"{contestant.name}: {value} instead of {of_value} ± {allowed}")
        if worst > GRADIENT_TOLERANCE[case.model] and not is_certified:
            raise AssertionError(f"{contestant.name}: gradient differs by {worst}")


def gradient_difference(found, reference, hyperparameters):
    """Largest |θ ΔdL/dθ| over the largest |θ dL/dθ|."""
    if found.keys() != reference.keys():
        raise AssertionError(f"gradients of {sorted(found)} and of {sorted(reference)}")
    theta = {name: free_entries(values) for name, values in hyperparameters.items()}
    triples = [
        (scale * a, scale * b)
        for name in reference
        for a, b, scale in zip(found[name], reference[name], theta[name], strict=True)
    ]
    return max(abs(a - b) for a, b in triples) / max(abs(b) for _, b in triples)


def free_entries(values):
    """A number or a list as a list; of a list of rows, what is on and below the diagonal, row by row."""
    if not isinstance(values, list):
        return [values]
    rows = [row[: idx + 1] if isinstance(row, list) else [row] for idx, row in enumerate(values)]
    return [entry for row in rows for entry in row]


def measure(contestants, rounds):
    turn = 0
    for round_idx in range(rounds):
        for contestant in contestants:
            for _ in range(contestant.turns):
                turn += 1
                # Dense contestants share one shift a round.
                at = shift(round_idx) if contestant.turns == 1 else shift(turn)
                contestant.seconds.append(contestant.evaluate(at)["seconds"])
            # Threads that spin after their work must not slow the next contestant.
            time.sleep(0.05)
        print(f"round {round_idx + 1} of {rounds}, load {os.getloadavg()[0]:.1f}", file=sys.stderr)


def report(case, contestants, options):
    """Medians and fastest turns; on a busy machine the fastest ones say more of contestants with several threads."""
    medians = {contestant.name: statistics.median(contestant.seconds) for contestant in contestants}
    fastest = {contestant.name: min(contestant.seconds) for contestant in contestants}
    print(f"\n### {case.title}, n = {options.n}, {options.threads} threads, {options.rounds} rounds\n")
    print("| contestant | median, s | fastest, s | ÷ LAPACK: medians | fastest | best peer ÷ it: medians | fastest | bound, nats | rank |")
    print("|---|---|---|---|---|---|---|---|---|")
    for contestant in contestants:
        name, last = contestant.name, contestant.last
        bound = last.get("error_bound")
        cells = [name, f"{medians[name]:.5f}", f"{fastest[name]:.5f}"]
        cells += [of_lapack(name, times) for times in (medians, fastest)]
        cells += [of_best_peer(name, times) for times in (medians, fastest)]
        cells += ["" if bound is None else f"{bound:.1e}", str(last.get("rank", options.n))]
        print("|", " | ".join(cells), "|")
    if case.model == "loads" and "GPy" in medians:
        quickest = min(medians[name] for name in medians if "certified" in name)
        print(f"\nMedians: dense ÷ fastest certified {medians[DENSE] / quickest:.2f},", end=" ")
        print(f"GPy ÷ dense {medians['GPy'] / medians[DENSE]:.1f}, GPy ÷ fastest certified {medians['GPy'] / quickest:.1f}.")
    if "GPyTorch" in medians:
        print(f"\nDense ÷ GPyTorch: medians {medians[DENSE] / medians['GPyTorch']:.3f},", end=" ")
        print(f"fastest {fastest[DENSE] / fastest['GPyTorch']:.3f}.")


def of_lapack(name, times):
    return f"{times[name] / times[LAPACK]:.4f}" if LAPACK in times else ""


def of_best_peer(name, times):
    peers = [times[peer] for peer in (*PEERS, "gprx") if peer in times]
    return f"{min(peers) / times[name]:.1f}" if peers else ""


def machine(contestants, options):
    names = [line.split(":", 1)[1].strip() for line in cpu_info().splitlines() if line.startswith("model name")]
    versions = {}
    for contestant in contestants:
        versions |= contestant.versions
    print(f"Machine: {len(names)} × {names[0] if names else platform.processor()}, load {os.getloadavg()[0]:.1f} at the end.")
    print(f"OPENBLAS_CORETYPE={environment(options.threads).get('OPENBLAS_CORETYPE', 'not set')}; torque-gp's certified path is sequential, its dense path shares its threads.")
    print("Versions: " + ", ".join(f"{name} {version}" for name, version in sorted(versions.items())) + ".")


def run(case, program, data, options):
    contestants = start(case, program, data, options)
    try:
        check_agreement(case, contestants)
        measure(contestants, options.rounds)
    finally:
        for contestant in contestants:
            contestant.stop()
    report(case, contestants, options)
    machine(contestants, options)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--n", type=int, default=4000, help="samples, at most 4000; of all loads together")
    parser.add_argument("--rounds", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2, help="of every contestant; the certified path uses one")
    parser.add_argument("--models", default="full,smooth")
    parser.add_argument("--joints", default="3,6", help="of the model of several loads, with a file each in loads/")
    parser.add_argument("--only", help="peers to run, with commas between their names; default all")
    options = parser.parse_args()
    program = build_program()
    with tempfile.TemporaryDirectory() as directory:
        for case in Case.all(options):
            data = str(Path(directory) / f"{case.title}.csv")
            subprocess.run([program, "data", *case.data, "--output", data], check=True)
            run(case, program, data, options)


if __name__ == "__main__":
    main()
