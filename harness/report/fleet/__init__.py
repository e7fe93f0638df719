"""A fleet's day on screen and as a page."""
