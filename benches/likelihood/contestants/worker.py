"""One contestant in a process of its own: a request per line, an answer per line.

Run by peers.py: worker.py MODULE DATA HYPERPARAMETERS N. The first line tells the versions of its packages
or why it cannot take part; then each line with a shift is answered by one evaluation.

A contestant's module has PACKAGES and `build(x, targets, at)`, which returns a function of hyperparameters:
(seconds, value, gradient by name with respect to standard deviations and length scales). The clock runs
from hyperparameters to value and gradient; translating parameters to its conventions and back is not on it.
"""

import importlib
import importlib.metadata
import json
import os
import sys

from samples import read_hyperparameters, read_samples, shifted


def answer(file, content):
    file.write(json.dumps(content) + "\n")
    file.flush()


def main():
    # Libraries print to standard output; keep it for the answers.
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    name, data, hyperparameters, n = sys.argv[1:]
    x, targets = read_samples(data, int(n))
    at = read_hyperparameters(hyperparameters)
    try:
        module = importlib.import_module(name)
        evaluate = module.build(x, targets, at)
    except (ImportError, ValueError) as error:
        answer(answers, {"skipped": str(error)})
        return
    answer(answers, {"versions": {name: importlib.metadata.version(name) for name in module.PACKAGES}})
    for line in sys.stdin:
        seconds, value, gradient = evaluate(shifted(at, float(line)))
        gradient = {name: [float(g) for g in values] for name, values in gradient.items()}
        answer(answers, {"seconds": seconds, "value": float(value), "gradient": gradient})


if __name__ == "__main__":
    main()
