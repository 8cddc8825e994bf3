"""`wbc-suite replay`: recorded episodes, played again."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wbc_suite.cli import options
from wbc_suite.cli.output import print

if TYPE_CHECKING:
    from wbc_suite.envs import RobotEnv
    from wbc_suite.recording import Episode


def replay(
    file: options.RecordingArgument,
    *,
    by: Annotated[
        Literal["states", "actions"],
        typer.Option(help="Set recorded states, or apply recorded actions."),
    ] = "actions",
    episode: Annotated[
        list[str] | None, typer.Option(help="Episode; repeatable. All by default.")
    ] = None,
    show: Annotated[
        Literal["browser", "screen"] | None,
        typer.Option(help="Play them in a page, or in MuJoCo's viewer."),
    ] = None,
    film: Annotated[
        Path | None, typer.Option(help="Write a video: .mp4, .webp or .gif.")
    ] = None,
    camera: Annotated[str, typer.Option(help="Camera of the video.")] = "agentview",
    size: Annotated[int, typer.Option(min=16, max=2048, help="Pixels.")] = 256,
    trust_files: options.TrustFilesOption = False,
    host: options.HostOption = "127.0.0.1",
    port: options.PortOption = None,
) -> None:
    """Replay episodes, and report whether they match the recording bit for bit."""
    from wbc_suite.recording import Dataset, rebuild
    from wbc_suite.recording.video import check_video
    from wbc_suite.viewers.episode_player import open_player, show_in_window
    from wbc_suite.viewers.page_server import PageServer
    from wbc_suite.viewers.replay_page import ReplayPage

    shown, by_states = {}, by == "states"
    if film is not None:
        check_video(film)
        shown = {"render_mode": "rgb_array", "render_camera": camera}
        shown |= {"render_size": (size, size)}
    with Dataset(file) as dataset:
        names = tuple(episode or dataset.names)
        env = rebuild(dataset, trust_files=trust_files, use_camera_obs=False, **shown)
        try:
            if show is not None:
                player = open_player(dataset, names, env, by_states=by_states)
                if show == "screen":
                    show_in_window(player, env)
                else:
                    site = PageServer(host, port)
                    ReplayPage(player, env, site, label=f"Replay · {file.name}").start()
                    options.serve_until_interrupted(site, f"Replay of {file}:")
                return
            played = map(dataset.episode, options.tracked(names, "Replaying"))
            exact = [_play(env, episode, by_states=by_states) for episode in played]
            if film is not None:
                drawn = map(dataset.episode, options.tracked(names, "Drawing"))
                _film(env, drawn, film, by_states=by_states)
        finally:
            env.close()
    if not by_states:
        print(f"{sum(exact)} of {len(exact)} episodes replay bit for bit.")


def _play(env: "RobotEnv", episode: "Episode", *, by_states: bool) -> bool:
    from wbc_suite.recording.replaying import divergence, play_states

    if by_states:
        result = f"{sum(1 for _ in play_states(env, episode))} states"
        success, exact = env.benchmark.success(), True
    else:
        found = divergence(env, episode)
        success, exact = found.success, found.exact
        result = f"{found.steps} actions, bit for bit as recorded"
        if not exact:
            result = (
                f"{found.steps} actions, differs from action {found.first} on, by "
                f"{found.largest:.2e} at most"
            )
    solved = "solved" if success else "not solved"
    print(f"  {episode.name}: {result}; at the end {solved}")
    return exact


def _film(
    env: "RobotEnv", episodes: Iterable["Episode"], path: Path, *, by_states: bool
) -> None:
    from wbc_suite.recording.video import RATE, episode_pictures, write_video

    control = env.config.control_freq
    every = max(1, round(control / RATE))
    pictures = (
        picture
        for episode in episodes
        for picture in episode_pictures(env, episode, by_states=by_states, every=every)
    )
    write_video(pictures, path, rate=control / every)
    print(f"Wrote {path}.")
