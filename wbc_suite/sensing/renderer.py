"""Pictures of a MuJoCo model without a display."""

from dataclasses import dataclass
from enum import StrEnum

import mujoco

from wbc_suite.errors import DeviceError
from wbc_suite.sensing import gl_backend

__all__ = ["RenderPreset", "make_renderer"]


class RenderPreset(StrEnum):
    """How much work goes into one picture.

    On a processor the shadow map and the multisampling cost 8 to 40 times more than
    everything else in a small scene; the resolution barely matters.
    """

    FAST = "fast"
    BALANCED = "balanced"
    QUALITY = "quality"


@dataclass(frozen=True, kw_only=True, slots=True)
class _Quality:
    shadow_map: int
    samples: int
    shadows: bool


_QUALITIES = {
    RenderPreset.FAST: _Quality(shadow_map=64, samples=0, shadows=False),
    RenderPreset.BALANCED: _Quality(shadow_map=1024, samples=0, shadows=True),
    RenderPreset.QUALITY: _Quality(shadow_map=4096, samples=8, shadows=True),
}


def make_renderer(
    model: mujoco.MjModel,
    *,
    width: int,
    height: int,
    preset: RenderPreset | str | None = None,
) -> mujoco.Renderer:
    """Make a `mujoco.Renderer` with a backend that works on this machine.

    It belongs to the thread that makes it. Making one takes 0.1 to 0.7 s, so keep it;
    close it (``with make_renderer(...) as renderer``) when done. The model is as it was
    when this returns.

    Args:
        model: What to draw.
        width: Of the picture, in pixels.
        height: Of the picture, in pixels.
        preset: None takes `RenderPreset.FAST` when the processor draws and
            `RenderPreset.QUALITY` when a graphics card does.

    Raises:
        DeviceError: If nothing on this machine can draw; the message holds the cure.
    """
    backend = gl_backend.activate()
    if preset is None:
        preset = RenderPreset.FAST if backend.software else RenderPreset.QUALITY
    quality = _QUALITIES[RenderPreset(preset)]
    renderer = _with_quality(model, quality, width, height)
    flags = renderer.scene.flags
    flags[mujoco.mjtRndFlag.mjRND_SHADOW] = quality.shadows
    flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = quality.shadows
    return renderer


def _with_quality(
    model: mujoco.MjModel, quality: _Quality, width: int, height: int
) -> mujoco.Renderer:
    """Make the renderer; MuJoCo takes these settings from the model, only once."""
    size, settings = model.vis.global_, model.vis.quality
    kept = size.offwidth, size.offheight, settings.shadowsize, settings.offsamples
    size.offwidth, size.offheight = width, height
    settings.shadowsize, settings.offsamples = quality.shadow_map, quality.samples
    try:
        return mujoco.Renderer(model, height, width)
    except (mujoco.FatalError, AttributeError, RuntimeError) as error:
        raise DeviceError(
            f"This machine cannot draw a picture: {error}. Install OpenGL: "
            f"{gl_backend.APT_COMMAND}   then: wbc-suite doctor"
        ) from error
    finally:
        size.offwidth, size.offheight = kept[:2]
        settings.shadowsize, settings.offsamples = kept[2:]
