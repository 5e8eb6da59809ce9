"""Results as text: pure functions, one module per format. Nothing here prints or
writes."""
