"""The class of mechanics: hysteresis operators that are linear in their weights, and the effects that break their symmetries."""
