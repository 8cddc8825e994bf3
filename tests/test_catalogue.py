"""Looking up files in the package's catalogue and in folders of users."""

from pathlib import Path

import pytest

from wbc_suite import catalogue
from wbc_suite.catalogue import Catalogue, user_cache
from wbc_suite.errors import ConfigError, UnknownNameError


@pytest.fixture
def folders(tmp_path):
    """Two roots: both have an arm `two_link`, the second also `other`."""
    for root, name in (("base", "two_link"), ("lab", "two_link"), ("lab", "other")):
        file = tmp_path / root / "robots" / "arm" / f"{name}.toml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f'[component]\nname = "{name.title().replace("_", "")}"\n')
    return tmp_path


@pytest.fixture
def own(folders):
    return Catalogue(root=folders / "base", extra=(folders / "lab",))


def test_names_are_those_of_all_folders(own):
    assert own.names("robots/arm") == ("other", "two_link")
    assert own.names("robots/nowhere") == ()


def test_files_of_later_folders_take_precedence(own, folders):
    lab = folders / "lab" / "robots" / "arm"
    assert own.files("robots/arm") == (lab / "other.toml", lab / "two_link.toml")
    assert own.find("robots/arm", "two_link", kind="arm").is_relative_to(lab)


@pytest.mark.parametrize("name", ["two_link", "TwoLink", "TWO-LINK", "twolink"])
def test_case_and_underscores_do_not_matter(own, name):
    assert own.holds("robots/arm", name)
    assert own.find("robots/arm", name, kind="arm").stem == "two_link"


def test_declared_names_are_listed_and_stems_of_unreadable_files(own, folders):
    lab = folders / "lab" / "robots" / "arm"
    (lab / "broken.toml").write_text("[[")
    (lab / "deep.toml").write_text("a = " + "[" * 5000)
    (lab / "nameless.toml").write_text("[component]\nname = 3\n")
    names = "broken", "deep", "nameless", "Other", "TwoLink"
    assert own.called("robots/arm") == names


def test_an_unknown_name_gets_the_nearest_one(own):
    assert not own.holds("robots/arm", "two_links")
    with pytest.raises(UnknownNameError, match="No arm named 'two_links'") as caught:
        own.find("robots/arm", "two_links", kind="arm")
    assert "Did you mean 'TwoLink'?" in str(caught.value)


def test_a_name_without_side_is_the_file_of_the_side(own, folders):
    for side in ("left", "right"):
        (folders / "lab" / "robots" / "arm" / f"my_{side}_hand.toml").write_text("")
    found = own.find("robots/arm", "MyHand", kind="hand", side="left")
    assert found.stem == "my_left_hand"
    with pytest.raises(UnknownNameError):
        own.find("robots/arm", "MyHand", kind="hand")


def test_a_folder_outside_the_catalogue_is_refused(own):
    with pytest.raises(ConfigError, match="lies outside the catalogue"):
        own.find("robots/../../etc", "passwd", kind="file")


def test_files_of_extra_folders_are_not_ours(own):
    extra, ours = own.files("robots/arm")[0], own.root / "robots/arm/two_link.toml"
    assert own.is_ours(ours)
    assert not own.is_ours(extra)


@pytest.mark.parametrize("extra", ["folder", Path("folder"), 3])
def test_extra_must_be_a_list_of_folders(extra):
    with pytest.raises(ConfigError, match="'extra' must be a list of folders"):
        Catalogue(extra=extra)


def test_a_missing_folder_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="does not exist"):
        Catalogue(extra=(tmp_path / "nowhere",))


def test_the_environment_variable_adds_folders(folders, monkeypatch):
    monkeypatch.setenv(catalogue.ENVIRONMENT_VARIABLE, str(folders / "lab"))
    assert "other" in Catalogue().names("robots/arm")


def test_the_cache_follows_the_xdg_variable(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert user_cache() == tmp_path / "wbc_suite"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert user_cache() == Path.home() / ".cache" / "wbc_suite"
