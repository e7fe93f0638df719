"""The report as one self-contained HTML page, with replays of recorded deliveries."""
