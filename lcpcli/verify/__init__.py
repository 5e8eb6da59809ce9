"""Verification of a z or of a proof: residuals, certificates, refinement, all on the
original data."""
