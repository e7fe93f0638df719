"""What a tuning study found: its report, tables and figures."""
