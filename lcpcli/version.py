"""The version of the package."""

VERSION = "1.16.0"
