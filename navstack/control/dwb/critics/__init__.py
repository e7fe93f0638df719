"""DWB's trajectory critics, one small file each."""
