"""The version of the package."""

VERSION = "1.22.0"
