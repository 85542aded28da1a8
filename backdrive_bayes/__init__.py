"""Bayesian inference of a robot reducer's geometric error, stiffness and friction from torque-angle loops."""
