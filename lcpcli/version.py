"""The version of the package."""

VERSION = "1.9.0"
