"""The version of the package."""

VERSION = "1.7.0"
