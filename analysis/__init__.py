"""Turns the records of a rasterbench study into figures, tables and a report."""

__version__ = "1"
