"""The functions of ``import navbench``: values in, results out; the commands print them."""
