"""Listed effects of the bench "ode"."""
