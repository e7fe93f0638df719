"""What a Nav2 file may hold, and what this program makes of it: one entry per algorithm."""
