"""What an ablation found: words, tables and a figure."""
