"""The benchmark's program: ``python -m navbench`` is ``navbench``."""
