"""The sources of problems, one in each folder, which the rest of the package knows by
the table in `model/formulations.py` alone: any of them may be missing."""
