"""From records and model to a posterior: likelihood, mode, discrepancy, sampling, files."""
