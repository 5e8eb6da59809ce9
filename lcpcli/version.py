"""The version of the package."""

VERSION = "1.8.0"
