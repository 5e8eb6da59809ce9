"""The version of the package."""

VERSION = "1.18.0"
