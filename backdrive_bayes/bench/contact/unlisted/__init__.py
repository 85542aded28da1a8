"""Effects that a diagnosis does not know: their true answer is `unknown`."""
