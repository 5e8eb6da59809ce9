"""The version of the package."""

VERSION = "1.5.0"
