"""The version of the package."""

VERSION = "1.13.0"
