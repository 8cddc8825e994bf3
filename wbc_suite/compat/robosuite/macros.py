"""Settings of the process, under robosuite's names.

A `macros_private.py` beside this file, as `setup_macros` writes it, comes after these.
"""

import contextlib
import importlib

SIMULATION_TIMESTEP = 0.002
"""Duration of a physics step, s, of which a control period at 20 Hz is a multiple; at
other rates `env.model_timestep` is a little shorter."""
USING_INSTANCE_RANDOMIZATION = False
ENABLE_NUMBA = True
CACHE_NUMBA = True
IMAGE_CONVENTION = "opengl"
"""`opengl`: row 0 of a picture is its lower edge; `opencv`: its upper edge."""
CONCATENATE_IMAGES = False
MUJOCO_GPU_RENDERING = True
SPACEMOUSE_VENDOR_ID = 9583
SPACEMOUSE_PRODUCT_ID = 50734
DUALSENSE_VENDOR_ID = 0x054C
DUALSENSE_PRODUCT_ID = 0x0CE6
CONSOLE_LOGGING_LEVEL = "INFO"
FILE_LOGGING_LEVEL = None

with contextlib.suppress(ImportError):
    _private = vars(importlib.import_module(f"{__package__}.macros_private"))
    globals().update({name: _private[name] for name in _private if name.isupper()})
