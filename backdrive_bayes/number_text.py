"""Values and intervals as text with sensible digits."""

from __future__ import annotations

import math

ARCMIN_PER_RAD = 10800.0 / math.pi
"""Inside all angles are in rad; screens and files show arcminutes."""
MOST_DECIMALS = 8
UNDEFINED = "not defined"
ENDS = ("median", "lo", "hi")
"""Keys of an interval."""
_LARGEST_PLAIN = 1e7  # longer numbers are not read at a glance


def decimals(spread: float, value: float) -> int:
    """Decimals that show ``spread`` (half an interval) to one or two digits, or ``value`` to three without a
    spread.
    """
    spread, value = abs(spread), abs(value)
    if spread == 0 or not math.isfinite(spread):
        return 3 if value == 0 else max(0, min(MOST_DECIMALS, 2 - math.floor(math.log10(value))))
    power = math.floor(math.log10(spread))
    # One unit of the last digit is then at most a third of the half-width.
    return max(0, min(MOST_DECIMALS, -power + (spread < 2.95 * 10**power)))


def interval_text(interval: dict | None, factor: float = 1.0) -> str:
    """``median [lo, hi]`` times ``factor`` with the same decimals; "not defined" for None."""
    if interval is None:
        return UNDEFINED
    median, lo, hi = (factor * interval[k] for k in ENDS)
    if max(abs(lo), abs(median), abs(hi)) < 0.5 * 10**-MOST_DECIMALS:
        lo = median = hi = 0.0
    n = decimals(0.5 * (hi - lo), median)
    return f"{_fixed(median, n)} [{_fixed(lo, n)}, {_fixed(hi, n)}]"


def marked(text: str, provisional: bool) -> str:
    """The text of an interval, "?" after its median where that is ``provisional``."""
    return text.replace(" [", "? [", 1) if provisional else text


def with_error(value: float, sd: float, unit: str = "") -> str:
    """``value ± sd`` with the decimals of the standard error; a plain number, unless it is too small or large for one."""
    if sd < 10**-MOST_DECIMALS or not max(abs(value), sd) < _LARGEST_PLAIN:
        return f"{significant(value)}{unit} ± {significant(sd, 1)}{unit}"
    n = decimals(sd, value)
    return f"{_fixed(value, n)}{unit} ± {_fixed(sd, n)}{unit}"


def like_interval(value: float | None, interval: dict | None, factor: float = 1.0) -> str:
    """A single value with the decimals of the interval beside it."""
    if value is None:
        return UNDEFINED
    spread = 0.5 * (interval["hi"] - interval["lo"]) if interval else 0.0
    return _fixed(factor * value, decimals(factor * spread, factor * value))


def fixed(value: float | None, n: int) -> str:
    """A value with ``n`` decimals."""
    return UNDEFINED if value is None or not math.isfinite(value) else _fixed(value, n)


def significant(value: float | None, digits: int = 3, factor: float = 1.0) -> str:
    """``factor`` times a value to some significant digits, without exponent where it can be helped."""
    if value is None or not math.isfinite(value):
        return UNDEFINED
    value *= factor
    if value == 0:
        return "0"
    power = int(f"{value:.{digits - 1}e}".partition("e")[2])
    if not -6 <= power <= 6:
        return f"{value:.{digits - 1}e}".replace("-", "−")
    return _fixed(value, max(0, digits - 1 - power))


def plain(value: float, digits: int = 3) -> str:
    """A torque or a rate that was set, to some significant digits, without zeros at its end."""
    text = significant(value, digits)
    return text.rstrip("0").rstrip(".") if "." in text and "e" not in text else text


def probability_text(probability: float | None) -> str:
    """A probability with two decimals, three near 0 and 1, never rounded to certainty."""
    if probability is None:
        return "–"
    if probability > 0.999 or probability < 0.001:
        return "> 0.999" if probability > 0.5 else "< 0.001"
    return f"{probability:.3f}" if probability > 0.9 or probability < 0.1 else f"{probability:.2f}"


def share_text(interval: dict | None) -> str:
    """A closed fraction with its interval as per cent; ends at −100 % are bounds, because fractions are clipped there."""
    if not interval:
        return "not defined"
    median, lo, hi = (_per_cent(interval[k]) for k in ("median", "lo", "hi"))
    return f"{median} %" if interval["lo"] == interval["hi"] else f"{median} % [{lo}, {hi}]"


def per_cent_text(share: float) -> str:
    """One share as per cent; −100 % is a bound."""
    return f"{_per_cent(share)} %"


def _per_cent(share):
    return "≤ −100" if share <= -0.995 else f"{round(100 * share)}".replace("-", "−")


def level_text(level: float) -> str:
    """The level of intervals as per cent."""
    return f"{100 * level:.3g} %"


def _fixed(value: float, n: int) -> str:
    text = f"{value:.{n}f}"
    return text.lstrip("-") if float(text) == 0 else text.replace("-", "−")
