"""The version of the package."""

VERSION = "1.10.1"
