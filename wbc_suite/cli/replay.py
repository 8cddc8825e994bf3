"""`wbc-suite replay`: recorded episodes, played again."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wbc_suite.cli.options import (
    HostOption,
    PortOption,
    RecordingArgument,
    TrustFilesOption,
    serve_until_interrupted,
    tracked,
)

if TYPE_CHECKING:
    from wbc_suite.envs import RobotEnv
    from wbc_suite.recording import Dataset, Episode

Way = Literal["states", "actions"]
Place = Literal["browser", "screen"]


def replay(
    file: RecordingArgument,
    *,
    by: Annotated[
        Way, typer.Option(help="States as recorded, or actions, open loop.")
    ] = "actions",
    episode: Annotated[
        list[str] | None, typer.Option(help="Episode; all when left out.")
    ] = None,
    show: Annotated[
        Place | None,
        typer.Option(help="Play them in a page, or in MuJoCo's own window."),
    ] = None,
    film: Annotated[
        Path | None, typer.Option(help="Write a film: .mp4, .webp or .gif.")
    ] = None,
    camera: Annotated[str, typer.Option(help="Camera of the film.")] = "agentview",
    size: Annotated[int, typer.Option(min=16, max=2048, help="Pixels.")] = 256,
    trust_files: TrustFilesOption = False,
    host: HostOption = "127.0.0.1",
    port: PortOption = None,
) -> None:
    """Play episodes again, and say whether they come out as they were recorded."""
    from wbc_suite.recording import Dataset, rebuild
    from wbc_suite.recording.video import check_video

    shown = {}
    if film is not None:
        check_video(film)
        shown = {"render_mode": "rgb_array", "render_camera": camera}
        shown |= {"render_size": (size, size)}
    with Dataset(file) as dataset:
        names = tuple(episode or dataset.names)
        env = rebuild(dataset, trust_files=trust_files, use_camera_obs=False, **shown)
        try:
            if show is not None:
                _show(env, dataset, names, by, show, (host, port))
                return
            played = tracked(names, "Replaying")
            exact = [_play(env, dataset.episode(name), by) for name in played]
            if film is not None:
                _film(env, dataset, names, by, film)
        finally:
            env.close()
    if by == "actions":
        print(f"{sum(exact)} of {len(exact)} episodes replay bit by bit.")


def _show(
    env: "RobotEnv",
    dataset: "Dataset",
    names: tuple[str, ...],
    by: Way,
    place: Place,
    address: tuple[str, int | None],
) -> None:
    """Show episodes until the user ends it."""
    from wbc_suite.viewers.episode_player import open_player

    player = open_player(dataset, names, env, by_states=by == "states")
    if place == "screen":
        from wbc_suite.viewers.replay_window import show_in_window

        show_in_window(player, env)
        return
    from wbc_suite.viewers.page_server import PageServer
    from wbc_suite.viewers.replay_page import ReplayPage

    page = ReplayPage(
        player, env, PageServer(*address), label=f"Replay · {dataset.path.name}"
    )
    page.start()
    serve_until_interrupted(page.site, f"Replay of {dataset.path}:")
    page.stop()


def _play(env: "RobotEnv", episode: "Episode", by: Way) -> bool:
    from wbc_suite.recording.replaying import divergence, play_states

    if by == "states":
        count = sum(1 for _ in play_states(env, episode))
        solved = "solved" if env.benchmark.success() else "not solved"
        print(f"  {episode.name}: {count} states; at the end {solved}")
        return True
    found = divergence(env, episode)
    how = (
        "bit by bit as recorded"
        if found.exact
        else f"differs from action {found.first} on, by {found.largest:.2e} at most"
    )
    solved = "solved" if found.success else "not solved"
    print(f"  {episode.name}: {found.steps} actions, {how}; at the end {solved}")
    return found.exact


def _film(
    env: "RobotEnv",
    dataset: "Dataset",
    names: tuple[str, ...],
    by: Way,
    path: Path,
) -> None:
    from wbc_suite.recording.video import RATE, episode_pictures, write_video

    control = env.config.control_freq
    every = max(1, round(control / RATE))
    write_video(
        (
            picture
            for name in tracked(names, "Drawing")
            for picture in episode_pictures(
                env, dataset.episode(name), by_states=by == "states", every=every
            )
        ),
        path,
        rate=control / every,
    )
    print(f"Wrote {path}.")
