"""The logger of this package, under robosuite's name."""

import logging

ROBOSUITE_DEFAULT_LOGGER = logging.getLogger("wbc_suite.compat.robosuite")
