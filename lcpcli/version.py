"""The version of the package."""

VERSION = "1.17.0"
