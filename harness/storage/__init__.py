"""Run folders, journals and tables on disk."""
