"""From the record of a bench to text: pure functions, one format a module. Nothing here prints or writes."""
