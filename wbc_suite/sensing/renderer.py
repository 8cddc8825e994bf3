"""Pictures of a MuJoCo model without a display."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import mujoco

from wbc_suite.errors import DeviceError
from wbc_suite.sensing import gl_backend
from wbc_suite.sensing.scene_renderer import SceneRenderer, coarse_floors

__all__ = ["RenderPreset", "make_renderer"]


class RenderPreset(StrEnum):
    """How much work goes into one picture.

    On a processor the shadow map and the multisampling cost 8 to 40 times more than
    everything else in a small scene; the resolution barely matters, vertices do. Rounds
    of 16 sides in place of 28 and a floor of 400 pieces in place of 40,000 save two
    thirds of the rest, and cannot be told apart.
    """

    FAST = "fast"
    BALANCED = "balanced"
    QUALITY = "quality"


@dataclass(frozen=True, kw_only=True, slots=True)
class _Quality:
    shadow_map: int
    samples: int
    shadows: bool
    slices: int = 28
    stacks: int = 16
    coarse: bool = True


_QUALITIES = {
    RenderPreset.FAST: _Quality(
        shadow_map=64, samples=0, shadows=False, slices=16, stacks=8
    ),
    RenderPreset.BALANCED: _Quality(shadow_map=1024, samples=0, shadows=True),
    RenderPreset.QUALITY: _Quality(
        shadow_map=4096, samples=8, shadows=True, coarse=False
    ),
}


def make_renderer(
    model: mujoco.MjModel,
    *,
    width: int,
    height: int,
    preset: RenderPreset | str | None = None,
) -> SceneRenderer:
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
    floors = coarse_floors(model) if quality.coarse else {}
    with _written(model, quality, floors, width, height):
        try:
            renderer = SceneRenderer(
                model, height, width, floors=floors, culls=not quality.shadows
            )
        except (mujoco.FatalError, AttributeError, RuntimeError) as error:
            raise DeviceError(
                f"This machine cannot draw a picture: {error}. Install OpenGL: "
                f"{gl_backend.APT_COMMAND}   then: wbc-suite doctor"
            ) from error
    flags = renderer.scene.flags
    flags[mujoco.mjtRndFlag.mjRND_SHADOW] = quality.shadows
    flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = quality.shadows
    return renderer


@contextmanager
def _written(
    model: mujoco.MjModel,
    quality: _Quality,
    floors: dict[int, Any],
    width: int,
    height: int,
) -> Iterator[None]:
    """Write settings into the model, where a new renderer reads them, only once."""
    size, settings, planes = model.vis.global_, model.vis.quality, list(floors)
    kept = [(part, name, getattr(part, name)) for part, name in _settings(model)]
    sizes = model.geom_size[planes].copy()
    size.offwidth, size.offheight = width, height
    settings.shadowsize, settings.offsamples = quality.shadow_map, quality.samples
    settings.numslices, settings.numstacks = quality.slices, quality.stacks
    for plane, floor in floors.items():
        model.geom_size[plane] = floor.size
    try:
        yield
    finally:
        model.geom_size[planes] = sizes
        for part, name, value in kept:
            setattr(part, name, value)


def _settings(model: mujoco.MjModel) -> list[tuple[Any, str]]:
    size, quality = ("offwidth", "offheight"), ("shadowsize", "offsamples")
    quality += ("numslices", "numstacks")
    return [(model.vis.global_, name) for name in size] + [
        (model.vis.quality, name) for name in quality
    ]
