"""From the record of a bench to text: pure functions, one module per format. Nothing here prints or writes."""
