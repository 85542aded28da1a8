"""Records whose truth is known, for tests and studies."""
