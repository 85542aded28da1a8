"""Effects of the bench "ode" that no library lists."""
