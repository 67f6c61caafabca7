"""Where the cache is."""

from motionstyle.cache import cache_folder


def test_cache_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.setenv("MOTIONSTYLE_CACHE", str(tmp_path / "mine"))
    assert cache_folder() == tmp_path / "mine"
    monkeypatch.delenv("MOTIONSTYLE_CACHE")
    assert cache_folder().name == "motionstyle"
