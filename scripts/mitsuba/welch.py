"""Welch's t-test, with Student's distribution from the incomplete beta function."""

import math

import numpy as np


def _continued_fraction(a, b, x):
    """Lentz's method for the continued fraction of the incomplete beta function."""
    tiny = 1e-300
    c, d = 1.0, 1.0 / ((1.0 - (a + b) * x / (a + 1.0)) or tiny)
    value = d
    for m in range(1, 10_000):
        for numerator in (m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
                          -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1))):
            d = 1.0 / ((1.0 + numerator * d) or tiny)
            c = (1.0 + numerator / c) or tiny
            value *= d * c
        if abs(d * c - 1.0) < 1e-14:
            return value
    raise ArithmeticError(f"the incomplete beta function of {a}, {b}, {x} did not converge")


def incomplete_beta(a, b, x):
    """The regularised incomplete beta function."""
    if x <= 0.0 or x >= 1.0:
        return min(max(x, 0.0), 1.0)
    front = math.exp(a * math.log(x) + b * math.log1p(-x) + math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b))
    if x < (a + 1) / (a + b + 2):
        return front * _continued_fraction(a, b, x) / a
    return 1.0 - front * _continued_fraction(b, a, 1.0 - x) / b


def two_sided(t, freedom):
    """The probability of a |t| as large as this."""
    return incomplete_beta(freedom / 2, 0.5, freedom / (freedom + t * t))


def quantile(p, freedom):
    """The t that is exceeded in absolute value with probability `p`."""
    low, high = 0.0, 1.0
    while two_sided(high, freedom) > p:
        high *= 2
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if two_sided(middle, freedom) > p else (low, middle)
    return high


def sidak(level, count):
    """The level of each of `count` tests that together have `level`."""
    return -math.expm1(math.log1p(-level) / count)


class Welch:
    """Differences of two means, elementwise, with their standard errors and degrees of freedom."""

    def __init__(self, mean_a, error_a, freedom_a, mean_b, error_b, freedom_b):
        va, vb = np.square(error_a), np.square(error_b)
        self.difference, self.scale = mean_a - mean_b, np.maximum(np.abs(mean_a), np.abs(mean_b))
        self.error = np.sqrt(va + vb)
        with np.errstate(invalid="ignore", divide="ignore"):
            freedom = (va + vb) ** 2 / (va ** 2 / freedom_a + vb ** 2 / freedom_b)
        self.freedom = np.where(self.error > 0, freedom, 1.0)

    @classmethod
    def of_runs(cls, a, b):
        """Of independent runs along the first axis."""
        return cls(*moments(a), *moments(b))

    def p_values(self, rounding):
        """Two-sided; a difference of `rounding` relative to the mean is forgiven, as that of single precision."""
        difference = np.maximum(np.abs(self.difference) - rounding * self.scale, 0.0)
        flat = zip(difference.flat, self.error.flat, self.freedom.flat)
        p = [1.0 if d == 0.0 else 0.0 if e == 0.0 else two_sided(d / e, f) for d, e, f in flat]
        return np.reshape(p, difference.shape)

    def detectable(self, level, power=0.9):
        """The relative bias that a test at `level` finds with the probability `power`."""
        t = [quantile(level, f) + quantile(2 * (1 - power), f) for f in self.freedom.flat]
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.where(self.scale > 0, np.reshape(t, self.error.shape) * self.error / self.scale, 0.0)


def moments(runs):
    """Mean, its standard error and degrees of freedom, over the first axis."""
    n = len(runs)
    return np.mean(runs, axis=0), np.std(runs, axis=0, ddof=1) / math.sqrt(n), n - 1
