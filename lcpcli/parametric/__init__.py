"""Solutions as functions of the data: exact paths from one problem to another, and
derivatives of solutions."""
