"""Values with their uncertainty: intervals, resamples, and comparisons of paired deliveries."""
