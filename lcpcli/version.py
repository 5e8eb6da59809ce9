"""The version of the package."""

VERSION = "1.14.0"
