"""Interfaces of other libraries, so that scripts written for them run here."""
