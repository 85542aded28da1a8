"""Bayesian inference of a robot reducer's geometric error, stiffness and friction from torque-angle loops.

    from backdrive_bayes import Unit, accept, compare, fit, report

    fitted = fit(Unit.read("data/reducer-1"), seed=1)
    verdict = accept(fitted, "data/limits.toml")
    report(fitted, verdict, out="out")

The names are loaded when they are first used, so that importing the package costs nothing.
"""

_LAZY = ("Unit", "Fit", "Diagnosis", "Verdict", "Comparison", "fit", "diagnose", "accept", "compare", "report", "BadInput")
__all__ = list(_LAZY)


def __getattr__(name):
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    value = getattr(import_module(f"{__name__}.{'errors' if name == 'BadInput' else 'api'}"), name)
    globals()[name] = value
    return value


def __dir__():
    return sorted({*globals(), *_LAZY})
