"""Families of problems by name, in files by theme, imported on demand;
lcpcli.gallery.families lists them."""
