"""The version of the package."""

VERSION = "1.15.0"
