"""From draws of the indicators to decisions: acceptance against limits, comparison of units, claims with probabilities."""
