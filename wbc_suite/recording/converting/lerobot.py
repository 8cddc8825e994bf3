"""LeRobot's dataset layout, version 3.0, by `pyarrow` and (for pictures) `av` alone.

    meta/info.json                                features, counts, path templates
    meta/stats.json                               of each feature
    meta/tasks.parquet                            task_index by task
    meta/episodes/chunk-000/file-000.parquet      where each episode is, and its stats
    data/chunk-000/file-000.parquet               one row per action
    videos/KEY/chunk-000/file-000.mp4             pictures, episode after episode

`observation.state` is the robots' `proprio-state`, or all observed vectors if there is
none; `observation.environment_state` is `object-state`; `observation.images.CAMERA` are
videos. Each piece of a conversion writes a `file-N` of its own.

Source: the documentation of LeRobotDataset v3.0 (huggingface.co/docs/lerobot).
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wbc_suite.atomic_files import new_folder, replace_file, write_bytes
from wbc_suite.config_files import parse_json
from wbc_suite.errors import DatasetError
from wbc_suite.extras import import_extra
from wbc_suite.recording.converting.layout import (
    Layout,
    Piece,
    Progress,
    policy_actions,
)
from wbc_suite.recording.dataset import Dataset
from wbc_suite.recording.episode import Episode
from wbc_suite.recording.video import Mp4Writer
from wbc_suite.robot.shapes import as_table

CHUNK = 1000  # files in a folder
MOMENTS = ("min", "max", "mean", "std")
QUANTILES = {"q01": 0.01, "q10": 0.10, "q50": 0.50, "q90": 0.90, "q99": 0.99}
SHAPE = ("height", "width", "channels")
PICTURE = "_image"  # how keys of pictures end
PICTURES_IN_STATS = 20  # of an episode, evenly spread; all of them would take minutes

Stats = dict[str, Any]


def _begin(out: Path) -> None:
    _import_pyarrow()
    new_folder(out, "a LeRobot dataset")


def _import_pyarrow() -> tuple[Any, Any]:
    arrow = import_extra("pyarrow", "lerobot")
    return arrow, import_extra("pyarrow.parquet", "lerobot")


def _write(
    dataset: Dataset, piece: Piece, out: Path, on_progress: Progress
) -> dict[str, Any]:
    """Write frames and videos of a piece; return its rows of the table of episodes."""
    arrow, parquet = _import_pyarrow()
    rate, place, tasks = _rate(dataset), _place(piece.number), _tasks(dataset)
    first = dataset.episode(piece.names[0])
    writers = {
        key: Mp4Writer(
            out / f"videos/{_feature(key)}/{place}.mp4",
            rate=rate,
            extra="lerobot",
            options={"g": "2", "crf": "23"},  # LeRobot's: every other is a key frame
        )
        for key in _pictures(first)
    }
    tables, rows, start = [], [], piece.start
    try:
        for number, name in enumerate(piece.names, start=piece.before):
            episode = dataset.episode(name)
            columns = _vectors(episode)
            task = _task(dataset, name)
            row_of_task = tasks.index(task)
            tables.append(_frames(arrow, columns, number, start, rate, row_of_task))
            stats = {name: _stats(column) for name, column in columns.items()}
            for key, writer in writers.items():
                pictures = episode.columns[f"obs/{key}"]
                for picture in pictures:
                    writer.add(picture)
                stats[_feature(key)] = _picture_stats(pictures)
            row = _episode_row(rate, piece, number, episode.length, start, writers)
            row["tasks"] = [task]
            for feature, figures in stats.items():
                row |= {f"stats/{feature}/{name}": v for name, v in figures.items()}
            rows.append(row)
            start += episode.length
            on_progress(1)
        table = arrow.concat_tables(tables)
    except (KeyError, arrow.ArrowInvalid) as error:
        raise DatasetError(f"Episodes differ in what they hold: {error}") from error
    finally:
        for writer in writers.values():
            writer.close()
    _write_table(parquet, table, out / f"data/{place}.parquet")
    return {"rows": rows}


def _finish(dataset: Dataset, out: Path, pieces: Sequence[Mapping[str, Any]]) -> None:
    """Write the files about all pieces, in the order of the episodes."""
    arrow, parquet = _import_pyarrow()
    rows = [row for piece in pieces for row in piece["rows"]]
    frames = [out / f"data/{_place(number)}.parquet" for number in range(len(pieces))]
    table = arrow.concat_tables([parquet.ParquetFile(path).read() for path in frames])
    episodes = arrow.Table.from_pylist(rows)
    _write_table(parquet, episodes, out / f"meta/episodes/{_place(0)}.parquet")
    known = _tasks(dataset)
    tasks = arrow.table({"task_index": [*range(len(known))], "task": known})
    keys = "name", "field_name", "pandas_type", "numpy_type", "metadata"
    columns = [
        ("task_index", "task_index", "int64", "int64", None),
        ("task", "task", "unicode", "object", None),
    ]
    pandas = {
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [dict(zip(keys, column, strict=True)) for column in columns],
        "creator": {"library": "pyarrow", "version": arrow.__version__},
        "pandas_version": "2.0.0",
    }
    tasks = tasks.replace_schema_metadata({"pandas": json.dumps(pandas)})
    _write_table(parquet, tasks, out / "meta/tasks.parquet")
    first = dataset.episode(dataset.names[0])
    info, stats = _info(dataset, first, len(table)), _all_stats(table, rows)
    write_bytes(out / "meta/info.json", json.dumps(info, indent=1).encode())
    write_bytes(out / "meta/stats.json", json.dumps(stats, indent=1).encode())


def _rate(dataset: Dataset) -> float:
    """Return the actions per second, an integer where it is a whole number."""
    rate = float(dataset.header.get("control_freq", 20.0))
    return int(rate) if rate.is_integer() else rate


def _task(dataset: Dataset, name: str) -> str:
    """Return the instruction of an episode; the environment's name if it has none."""
    other = dataset.header.get("env", "demonstration")
    return str(dataset.facts(name).get("instruction", other))


def _tasks(dataset: Dataset) -> list[str]:
    """Return the instructions of all episodes, each once, in order of their numbers."""
    return sorted({_task(dataset, name) for name in dataset.names})


def _pictures(episode: Episode) -> list[str]:
    return [key for key in episode.observed if key.endswith(PICTURE)]


def _place(number: int) -> str:
    """Return where the files of a piece are, without their ends."""
    return f"chunk-{number // CHUNK:03d}/file-{number % CHUNK:03d}"


def _feature(key: str) -> str:
    return f"observation.images.{key.removesuffix(PICTURE)}"


def _vectors(episode: Episode) -> dict[str, NDArray[np.float32]]:
    """Return the vectors of an episode by LeRobot's names."""
    seen = {k: episode.columns[f"obs/{k}"] for k in episode.observed}
    flat = {k: c.reshape(len(c), -1) for k, c in seen.items() if c.ndim <= 2}
    states = [flat[k] for k in sorted(flat) if k.endswith("proprio-state")]
    if not states:
        states = [flat[k] for k in sorted(flat)] or [episode.columns["states"]]
    found = {"observation.state": np.concatenate(states, axis=1)}
    if "object-state" in flat:
        found["observation.environment_state"] = flat["object-state"]
    found["action"] = policy_actions(episode)
    return {name: column.astype(np.float32) for name, column in found.items()}


def _frames(
    arrow: Any,
    columns: Mapping[str, Any],
    number: int,
    start: int,
    rate: float,
    task: int,
) -> Any:
    table = {
        name: arrow.FixedSizeListArray.from_arrays(column.ravel(), column.shape[1])
        for name, column in columns.items()
    }
    frames = np.arange(len(columns["action"]), dtype=np.int64)
    table["timestamp"] = (frames / rate).astype(np.float32)
    table["frame_index"] = frames
    table["episode_index"] = np.full_like(frames, number)
    table["index"] = frames + start
    table["task_index"] = np.full_like(frames, task)
    return arrow.table(table)


def _stats(column: NDArray[Any]) -> Stats:
    values = np.asarray(column, dtype=np.float64)
    found = {name: getattr(values, name)(axis=0).tolist() for name in MOMENTS}
    quantiles = np.quantile(values, list(QUANTILES.values()), axis=0).tolist()
    found |= dict(zip(QUANTILES, quantiles, strict=True))
    return found | {"count": [len(values)]}


def _picture_stats(pictures: NDArray[np.uint8]) -> Stats:
    """Return the stats of a few pictures by colour, 0 to 1, of shape (3, 1, 1)."""
    at = np.linspace(0, len(pictures) - 1, PICTURES_IN_STATS).round().astype(int)
    chosen = pictures[np.unique(at)]
    found = _stats(chosen.reshape(-1, 3) / 255.0)
    shaped = {n: [[[v]] for v in values] for n, values in found.items() if n != "count"}
    return {**shaped, "count": [len(chosen)]}


def _episode_row(
    rate: float,
    piece: Piece,
    number: int,
    length: int,
    start: int,
    videos: Iterable[str],
) -> dict[str, Any]:
    place = {"chunk_index": piece.number // CHUNK, "file_index": piece.number % CHUNK}
    row: dict[str, Any] = {
        "episode_index": number,
        "length": length,
        "dataset_from_index": start,
        "dataset_to_index": start + length,
        "meta/episodes/chunk_index": 0,
        "meta/episodes/file_index": 0,
    }
    row |= {f"data/{name}": value for name, value in place.items()}
    for key in videos:
        film, shown = f"videos/{_feature(key)}", start - piece.start
        row |= {f"{film}/{name}": value for name, value in place.items()}
        row[f"{film}/from_timestamp"] = shown / rate
        row[f"{film}/to_timestamp"] = (shown + length) / rate
    return row


def _info(dataset: Dataset, first: Episode, frames: int) -> dict[str, Any]:
    videos, rate = _pictures(first), _rate(dataset)
    features: dict[str, Any] = {
        name: {"dtype": "float32", "shape": [column.shape[1]], "names": None}
        for name, column in _vectors(first).items()
    }
    for key in videos:
        shape = dict(zip(SHAPE, first.columns[f"obs/{key}"].shape[1:], strict=True))
        info = {"codec": "h264", "pix_fmt": "yuv420p", "is_depth_map": False}
        info |= {"fps": rate, **shape}
        features[_feature(key)] = {
            "dtype": "video",
            "shape": list(shape.values()),
            "names": list(shape),
            "info": {f"video.{name}": value for name, value in info.items()}
            | {"has_audio": False},
        }
    features["timestamp"] = {"dtype": "float32", "shape": [1], "names": None}
    for name in ("frame_index", "episode_index", "index", "task_index"):
        features[name] = {"dtype": "int64", "shape": [1], "names": None}
    text = str(dataset.header.get("env_args", "{}"))
    source = parse_json(text, source="env_args", error=DatasetError)
    robots = as_table(source.get("env_kwargs")).get("robots", "unknown")
    place = "chunk-{chunk_index:03d}/file-{file_index:03d}"
    return {
        "codebase_version": "v3.0",
        "robot_type": " ".join(robots) if isinstance(robots, list) else str(robots),
        "total_episodes": len(dataset),
        "total_frames": frames,
        "total_tasks": len(_tasks(dataset)),
        "chunks_size": CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": rate,
        "splits": {"train": f"0:{len(dataset)}"},
        "data_path": f"data/{place}.parquet",
        "video_path": f"videos/{{video_key}}/{place}.mp4" if videos else None,
        "features": features,
    }


def _all_stats(table: Any, rows: list[dict[str, Any]]) -> dict[str, Stats]:
    """Return the stats of all frames; those of pictures from those of episodes."""
    found = {}
    for name in table.column_names:
        column = np.array(table[name].to_pylist(), dtype=np.float64)
        found[name] = _stats(column.reshape(len(column), -1))
    keys = {k.split("/")[1] for k in rows[0] if k.startswith("stats/")} - set(found)
    for key in keys:
        held = {
            name: np.array([row[f"stats/{key}/{name}"] for row in rows])
            for name in (*MOMENTS, *QUANTILES, "count")
        }
        all_frames = {q: held[q].mean(axis=0) for q in ("mean", *QUANTILES)}
        spread = held["std"] ** 2 + (held["mean"] - all_frames["mean"]) ** 2
        all_frames["std"] = np.sqrt(spread.mean(axis=0))
        for name, reduce in (("min", np.min), ("max", np.max), ("count", np.sum)):
            all_frames[name] = reduce(held[name], axis=0)
        found[key] = {name: value.tolist() for name, value in all_frames.items()}
    return found


def _write_table(parquet: Any, table: Any, path: Path) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, lambda temporary: parquet.write_table(table, temporary))


LAYOUT = Layout(begin=_begin, write=_write, finish=_finish, in_pieces=True)
