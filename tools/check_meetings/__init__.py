"""Whether the estimator by meetings tells the truth: people hit, and what its intervals hold."""
