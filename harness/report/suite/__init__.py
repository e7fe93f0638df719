"""What a suite folder comes to: its overview, its page, its tables and its figures."""
