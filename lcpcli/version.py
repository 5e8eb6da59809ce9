"""The version of the package."""

VERSION = "1.11.0"
