"""The command line program ``navbench``: one file per command."""
