"""The version of the package."""

VERSION = "1.12.0"
