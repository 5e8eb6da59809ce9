"""The version of the package."""

VERSION = "1.19.0"
