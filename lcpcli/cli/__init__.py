"""The command lcp: one module per command, imported on demand."""
