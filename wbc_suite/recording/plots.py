"""Pictures of a dataset: a chart of its episodes, and a contact sheet."""

from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from wbc_suite.atomic_files import check_folder, replace_file
from wbc_suite.envs import RobotEnv
from wbc_suite.errors import DatasetError
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.env_source import rebuild
from wbc_suite.recording.replaying import play_states
from wbc_suite.typing import Vector

WIDTH, HEIGHT, MARGIN = 720, 150, 28  # pixels of one plot
INK, CURVE, GOOD, BAD = "#333333", "#4a6fa5", "#3f8f5b", "#c8553d"
MOST_DRAWN = 400  # episodes and points that are drawn at most
SHEET_ROWS, SHEET_COLUMNS, SHEET_SIZE = 12, 6, 128  # episodes, pictures, pixels
LABEL = 14  # pixels


def write_plots(dataset: Dataset, path: Path) -> None:
    """Draw lengths by episode, and how actions and rewards spread."""
    names = dataset.names[:MOST_DRAWN]
    if not names:
        raise DatasetError(f"'{dataset.path}' has no episodes to plot.")
    lengths = np.array([dataset.length(name) for name in names], dtype=np.float64)
    successes = [dataset.facts(name).get("success") for name in names]
    actions = np.concatenate([dataset.column(name, "actions") for name in names])
    sheet = Image.new("RGB", (WIDTH, 3 * HEIGHT), "white")
    pen = ImageDraw.Draw(sheet)
    colours = [CURVE if s is None else GOOD if s else BAD for s in successes]
    _bars(pen, 0, "Actions per episode (green: success)", lengths, colours)
    spread = actions.std(axis=0)
    _bars(pen, 1, "Spread of each action", spread, [CURVE] * len(spread))
    sizes = np.linalg.norm(actions[:: len(actions) // MOST_DRAWN + 1], axis=1)
    _bars(pen, 2, "Size of the action over time", sizes, [CURVE] * len(sizes))
    check_folder(path.parent)
    replace_file(path, sheet.save)


def _bars(
    pen: ImageDraw.ImageDraw, place: int, title: str, values: Vector, colours: list[str]
) -> None:
    """Draw a bar for each value, from 0 to the largest."""
    top, bottom = place * HEIGHT + MARGIN, (place + 1) * HEIGHT - 8
    most = float(values.max()) or 1.0
    pen.text((MARGIN, top - 20), f"{title}; largest {most:.3g}", fill=INK)
    wide = (WIDTH - 2 * MARGIN) / len(values)
    thick = max(1.0, min(0.85 * wide, 40.0))
    for k, (value, colour) in enumerate(zip(values, colours, strict=True)):
        left = MARGIN + (k + 0.5) * wide - thick / 2.0
        y = bottom - (bottom - top) * value / most
        pen.rectangle((left, y, left + thick - 1.0, bottom), fill=colour)


def write_sheet(dataset: Dataset, path: Path, *, camera: str = "agentview") -> None:
    """Draw episodes, one per row, by their pictures of the camera or their states."""
    names = dataset.names[:SHEET_ROWS]
    if not names:
        raise DatasetError(f"'{dataset.path}' has no episodes to draw.")
    env: RobotEnv | None = None
    height = SHEET_SIZE + LABEL
    size = SHEET_COLUMNS * SHEET_SIZE, len(names) * height
    sheet = Image.new("RGB", size, "white")
    pen = ImageDraw.Draw(sheet)
    for row, episode in enumerate(map(dataset.episode, names)):
        word = {None: "", True: ", success", False: ", no success"}[episode.success]
        caption = f"{episode.name}: {episode.length} actions{word}"
        pen.text((4, row * height + 1), caption, fill="black")
        at = np.linspace(0, episode.length - 1, SHEET_COLUMNS).round().astype(int)
        pictures: Any = episode.columns.get(f"obs/{camera}_image")
        if pictures is None:
            env = env or rebuild(
                dataset,
                render_mode="rgb_array",
                render_camera=camera,
                render_size=(SHEET_SIZE, SHEET_SIZE),
                use_camera_obs=False,
            )
            states = play_states(env, episode)
            pictures = {k: np.asarray(env.render()) for k in states if k in at}
        for column, k in enumerate(at.tolist()):
            image = Image.fromarray(pictures[k]).resize((SHEET_SIZE, SHEET_SIZE))
            sheet.paste(image, (column * SHEET_SIZE, row * height + LABEL))
    if env is not None:
        env.close()
    check_folder(path.parent)
    replace_file(path, sheet.save)
