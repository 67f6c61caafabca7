"""The doors: cache, mirrors, upstream over a local server, and the table of datasets."""

from __future__ import annotations

import socket
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from urllib.parse import unquote
from urllib.request import ProxyHandler, build_opener

import pytest

from made_files import digest, nothing_left, put
from motionstyle.errors import MotionStyleError
from motionstyle.files import file_sha256
from motionstyle.mocap.datasets import doors
from motionstyle.mocap.datasets.doors import DatasetFile, cached_file, fetch_file, read_datasets

ROOT = Path(__file__).parents[2]
MIRROR = ROOT.parent / "shared" / "mocap"
COMMIT = "0123456789abcdef0123456789abcdef01234567"
DATA = b"HIERARCHY\n" + bytes(range(256)) * 40


def pinned(data: bytes = DATA, path: str = "set/walk.bvh", upstream: str = "data/walk.bvh"):
    return DatasetFile("set", path, "owner/name", COMMIT, upstream, digest(data), "MIT", "")


class Server:
    """A server on 127.0.0.1 whose pages are (status, headers, body) by path."""

    def __init__(self, port: int) -> None:
        self.pages: dict[str, list[tuple[int, dict[str, str], bytes]]] = {}
        self.asked: list[str] = []
        self.template = f"http://127.0.0.1:{port}/{{repository}}/{{commit}}/{{upstream_path}}"
        self.base = f"http://127.0.0.1:{port}"

    def page(self, path: str, *answers: tuple[int, dict[str, str], bytes]) -> None:
        self.pages[path] = list(answers)

    def upstream(self, body: bytes, *, status: int = 200, path: str = "data/walk.bvh", **headers):
        self.page(f"/owner/name/{COMMIT}/{path}", (status, headers, body))


@pytest.fixture
def server():
    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            path = unquote(self.path)
            state.asked.append(path)
            answers = state.pages.get(path, [(404, {}, b"404: Not Found")])
            status, headers, body = answers.pop(0) if len(answers) > 1 else answers[0]
            self.send_response(status)
            for name, value in {"Content-Length": str(len(body)), **headers}.items():
                self.send_header(name, value)
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, *_):
            pass

    with ThreadingHTTPServer(("127.0.0.1", 0), Handler) as httpd:
        state = Server(httpd.server_address[1])
        thread = threading.Thread(target=httpd.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield state
        httpd.shutdown()
        thread.join()


@pytest.fixture
def fetch(tmp_path):
    """`fetch_file` into tmp_path with no proxy, no pause and, unless given, no host at all."""
    opener = build_opener(ProxyHandler({}))
    lines: list[str] = []

    def call(entry, *, template="http://127.0.0.1:1/{upstream_path}", mirrors=(), **options):
        return fetch_file(
            entry,
            tmp_path / "out" / Path(entry.path).name,
            cache_dir=tmp_path / "cache",
            mirrors=mirrors,
            log=lines.append,
            url_template=template,
            opener=opener,
            pause_s=0,
            **{"timeout_s": 5, **options},
        )

    call.lines = lines
    yield call
    opener.close()


# --- upstream ------------------------------------------------------------------------------


def test_right_file_comes_from_upstream_and_is_kept_in_the_cache(server, fetch, tmp_path):
    server.upstream(DATA)
    record = fetch(pinned(), template=server.template)
    assert record.source == "upstream"
    assert record.destination.read_bytes() == DATA
    assert cached_file(tmp_path / "cache", digest(DATA)).read_bytes() == DATA
    assert server.asked == [f"/owner/name/{COMMIT}/data/walk.bvh"]


def test_wrong_checksum_upstream_is_refused(server, fetch, tmp_path):
    server.upstream(b"something else")
    with pytest.raises(MotionStyleError) as caught:
        fetch(pinned(), template=server.template)
    wrong = digest(b"something else")
    assert f"data/walk.bvh: wrong checksum: sha256 {wrong}, 14 bytes" in str(caught.value)
    assert nothing_left(tmp_path)


def test_one_error_names_clip_sources_reasons_and_remedy(server, fetch, tmp_path):
    put(tmp_path / "mirror" / "set" / "walk.bvh", b"old")
    put(cached_file(tmp_path / "cache", digest(DATA)), b"rotten")
    with pytest.raises(MotionStyleError) as caught:
        fetch(pinned(), template=server.template, mirrors=["absent", "mirror"], root=tmp_path)
    message = str(caught.value)
    kept = cached_file(tmp_path / "cache", digest(DATA))
    first, *tried, last = message.splitlines()
    assert first == (
        "clip set/walk.bvh (dataset set): no source gave the file with sha256 " + digest(DATA)
    )
    assert tried == [
        f"- {kept}: wrong checksum: sha256 {digest(b'rotten')}, 6 bytes",
        f"- {tmp_path}/absent/set/walk.bvh: the mirror folder is absent",
        f"- {tmp_path}/mirror/set/walk.bvh: wrong checksum: sha256 {digest(b'old')}, 3 bytes",
        f"- {server.base}/owner/name/{COMMIT}/data/walk.bvh: HTTP 404 Not Found: the commit or"
        " the path is no longer there",
    ]
    assert last == (
        f"Put the file into {kept}, or configure a mirror folder that holds set/walk.bvh in"
        " `mirrors:`, or check the network and run again."
    )


def test_404_is_not_tried_again(server, fetch):
    with pytest.raises(MotionStyleError, match="HTTP 404 Not Found: the commit or the path"):
        fetch(pinned(), template=server.template)
    assert len(server.asked) == 1


def test_403_says_that_the_host_refuses(server, fetch):
    server.upstream(b"", status=403)
    with pytest.raises(MotionStyleError, match="HTTP 403 Forbidden: the host refuses; wait"):
        fetch(pinned(), template=server.template)


def test_truncated_body_is_tried_again_and_told(server, fetch, tmp_path):
    server.upstream(DATA[:100], **{"Content-Length": str(len(DATA))})
    with pytest.raises(MotionStyleError) as caught:
        fetch(pinned(), template=server.template)
    wanted = f"truncated download: 100 of {len(DATA)} bytes came (3 tries)"
    assert wanted in str(caught.value)
    assert len(server.asked) == 3
    assert nothing_left(tmp_path)


def test_truncated_once_then_whole_succeeds(server, fetch):
    short = (200, {"Content-Length": str(len(DATA))}, DATA[:100])
    server.page(f"/owner/name/{COMMIT}/data/walk.bvh", short, (200, {}, DATA))
    assert fetch(pinned(), template=server.template).source == "upstream"
    assert any("trying again" in line for line in fetch.lines)


def test_passing_server_error_is_tried_again(server, fetch):
    server.page(f"/owner/name/{COMMIT}/data/walk.bvh", (503, {}, b""), (200, {}, DATA))
    assert fetch(pinned(), template=server.template).source == "upstream"


def test_host_down_is_told(fetch, tmp_path):
    with socket.socket() as closed:
        closed.bind(("127.0.0.1", 0))
        port = closed.getsockname()[1]
    with pytest.raises(MotionStyleError, match=r"no connection: .*refused.* \(3 tries\)"):
        fetch(pinned(), template=f"http://127.0.0.1:{port}/{{upstream_path}}")
    assert nothing_left(tmp_path)


def test_silent_host_is_given_up(fetch):
    with socket.create_server(("127.0.0.1", 0)) as mute:
        template = f"http://127.0.0.1:{mute.getsockname()[1]}/{{upstream_path}}"
        with pytest.raises(MotionStyleError, match=r"no answer within 0.05 s \(3 tries\)"):
            fetch(pinned(), template=template, timeout_s=0.05)


def test_redirect_is_followed(server, fetch):
    server.upstream(b"", status=301, Location="/moved/walk.bvh")
    server.page("/moved/walk.bvh", (200, {}, DATA))
    assert fetch(pinned(), template=server.template).destination.read_bytes() == DATA


def test_redirect_to_a_web_page_is_told(server, fetch):
    server.upstream(b"", status=302, Location="/login")
    server.page("/login", (200, {}, b"\n<!DOCTYPE html><title>Sign in</title>"))
    with pytest.raises(MotionStyleError, match=r"a web page, not the file \(redirected to http"):
        fetch(pinned(), template=server.template)


def test_redirect_that_leads_nowhere_is_told(server, fetch):
    server.upstream(b"", status=301)
    with pytest.raises(MotionStyleError, match=r"a redirect that leads nowhere \(no address\)"):
        fetch(pinned(), template=server.template)


def test_git_lfs_pointer_is_named(server, fetch):
    server.upstream(b"version https://git-lfs.github.com/spec/v1\noid sha256:12\nsize 3\n")
    with pytest.raises(MotionStyleError, match="a Git LFS pointer, not the file itself"):
        fetch(pinned(), template=server.template)


def test_spaces_and_letters_beyond_ascii_in_paths(server, fetch):
    name = "a set/žwalk nº 1 + 50%.bvh"
    server.upstream(DATA, path=f"data/{name}")
    record = fetch(pinned(path=name, upstream=f"data/{name}"), template=server.template)
    assert record.destination.name == "žwalk nº 1 + 50%.bvh"
    assert record.destination.read_bytes() == DATA
    assert "data/a%20set/%C5%BEwalk%20n%C2%BA%201%20%2B%2050%25.bvh" in record.location


# --- cache and mirrors ---------------------------------------------------------------------


def test_cache_hit_needs_no_network(fetch, tmp_path):
    put(cached_file(tmp_path / "cache", digest(DATA)), DATA)
    record = fetch(pinned())
    assert (record.source, record.failures) == ("cache", ())
    assert record.destination.read_bytes() == DATA


def test_mirror_is_used_and_not_copied_into_the_cache(fetch, tmp_path):
    put(tmp_path / "mirror" / "set" / "walk.bvh", DATA)
    record = fetch(pinned(), mirrors=[tmp_path / "mirror"])
    assert record.source == "mirror"
    assert not (tmp_path / "cache").exists()


def test_absent_mirror_is_skipped_silently(server, fetch):
    server.upstream(DATA)
    assert fetch(pinned(), template=server.template, mirrors=["no/such"]).source == "upstream"
    assert not any("no/such" in line for line in fetch.lines)


def test_wrong_file_in_a_mirror_is_recorded_and_the_next_source_tried(server, fetch, tmp_path):
    server.upstream(DATA)
    bad = put(tmp_path / "mirror" / "set" / "walk.bvh", b"old")
    record = fetch(pinned(), template=server.template, mirrors=[tmp_path / "mirror"])
    assert record.source == "upstream"
    reason = f"wrong checksum: sha256 {digest(b'old')}, 3 bytes"
    assert record.failures[1] == (str(bad), reason)
    assert f"set/walk.bvh: mirror {bad}: {reason}" in fetch.lines


def test_corrupted_cache_is_fetched_again_and_mended(server, fetch, tmp_path):
    kept = put(cached_file(tmp_path / "cache", digest(DATA)), DATA[:-1])
    server.upstream(DATA)
    assert fetch(pinned(), template=server.template).source == "upstream"
    assert kept.read_bytes() == DATA


def test_unwritable_destination_is_one_line(fetch, tmp_path):
    put(cached_file(tmp_path / "cache", digest(DATA)), DATA)
    (tmp_path / "out").write_text("a file where a folder should be")
    with pytest.raises(MotionStyleError, match=r"cannot write .*walk\.bvh: ") as caught:
        fetch(pinned())
    assert "\n" not in str(caught.value)


def test_unwritable_cache_does_not_stop_the_fetch(server, fetch, tmp_path):
    (tmp_path / "cache").write_text("a file where a folder should be")
    server.upstream(DATA)
    assert fetch(pinned(), template=server.template).destination.read_bytes() == DATA
    assert any(line.startswith("not kept in the cache") for line in fetch.lines)


# --- the table of datasets -----------------------------------------------------------------


def table(path: Path, *rows: str, header: str = "\t".join(doors.DATASET_COLUMNS)) -> Path:
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


def test_all_problems_of_the_datasets_table_are_told_at_once(tmp_path):
    good = ["set", "a.bvh", "o/n", COMMIT, "a.bvh", "a" * 64, "MIT", ""]
    rows = [
        "\t".join(good),
        "\t".join(good),
        "\t".join([*good[:5], "A" * 64, *good[6:]]).replace("a.bvh", "../b.bvh"),
        "short\trow",
    ]
    with pytest.raises(MotionStyleError) as caught:
        read_datasets(table(tmp_path / "datasets.tsv", *rows))
    assert str(caught.value).splitlines() == [
        "datasets.tsv row 3: a.bvh of set is listed twice",
        f"datasets.tsv row 4, column sha256: '{'A' * 64}' is not 64 lower-case hexadecimal digits",
        "datasets.tsv row 4, column path: '../b.bvh' is not a relative path",
        "datasets.tsv row 4, column upstream_path: '../b.bvh' is not a relative path",
        "datasets.tsv row 5: 2 cells, expected 8",
    ]


def test_wrong_columns_of_the_datasets_table(tmp_path):
    with pytest.raises(MotionStyleError, match=r"must name the columns dataset, .*; found a, b"):
        read_datasets(table(tmp_path / "datasets.tsv", header="a\tb"))


def test_shipped_table_is_whole():
    entries = read_datasets(ROOT / "config" / "datasets.tsv")
    assert len(entries) == 388
    assert sum(path.endswith(".bvh") for _, path in entries) == 342
    assert all(entry.licence for entry in entries.values())


def test_unknown_file_and_dataset_have_near_matches():
    entries = {("bandai", "bandai/walk.bvh"): pinned()}
    with pytest.raises(MotionStyleError, match=r"not a file of dataset bandai \(did you mean band"):
        doors.dataset_file(entries, "bandai", "bandai/wlak.bvh")
    with pytest.raises(MotionStyleError, match=r"not a dataset of datasets.tsv \(did you mean ban"):
        doors.dataset_file(entries, "bandia", "bandai/walk.bvh")


@pytest.mark.mirror
@pytest.mark.skipif(not MIRROR.is_dir(), reason="no mirror folder beside the clone")
def test_sample_of_the_mirror_has_the_pinned_checksums():
    entries = list(read_datasets(ROOT / "config" / "datasets.tsv").values())
    for entry in entries[:: len(entries) // 20]:
        assert file_sha256(MIRROR / entry.path) == entry.sha256, entry.path
