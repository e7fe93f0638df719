"""One stack with one localizer after the other on the same deliveries: what localization is worth."""
