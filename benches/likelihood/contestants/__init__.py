"""The contestants in Python: one module each, with `build(x, targets, at)` and `PACKAGES`.

`build` returns a function of hyperparameters that evaluates log marginal likelihood and gradient once:
(seconds, value, gradient by name with respect to standard deviations and length scales).
"""
