"""The version of the package."""

VERSION = "1.6.0"
