"""The version of the package."""

VERSION = "1.20.0"
