"""Real streets: OpenStreetMap extracts as scenes, and routes along their sidewalks."""
