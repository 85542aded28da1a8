"""The one inference engine: reduced data, marginal likelihood, posterior."""
