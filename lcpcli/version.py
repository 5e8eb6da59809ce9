"""The version of the package."""

VERSION = "1.21.0"
