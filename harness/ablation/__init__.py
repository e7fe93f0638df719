"""One stack with one localizer after the other on the same deliveries.

What localization is worth.
"""
