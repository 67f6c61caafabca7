"""The report page: everything in one file, nothing hidden, nothing taken from outside."""

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from motionstyle.errors import MotionStyleError
from motionstyle.evaluation.claims import VERDICTS, ClaimResult, evaluate_claims, load_claims
from motionstyle.report.page import embed_image, summarise_clips, write_report

REPOSITORY = Path(__file__).parents[2]
PNG = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
SVG = b'<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1"></svg>'
CLIPS = """id,dataset,marker_rms_cm,status,reason
good,embedded,1.0,ok,
also_good,embedded,2.0,ok,
bad,embedded,,failed,joint <b>LeftFoot</b> & frame 3
"""
VOID = {"meta", "br", "img", "col"}


class Page(HTMLParser):
    """Tags and text of a page; every tag opened must be closed in order."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.text = [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if self.open and self.open[-1] != "style":
            self.text.append(data)

    def all(self, tag):
        return [attributes for name, attributes in self.tags if name == tag]

    @property
    def words(self):
        return " ".join(" ".join(self.text).split())


@pytest.fixture(scope="module")
def claims():
    return load_claims(
        REPOSITORY / "config" / "claims.yaml",
        REPOSITORY / "workflow" / "schemas" / "claims.schema.json",
    )


@pytest.fixture
def render(tmp_path, claims):
    def run(results=None, clips=None, **options):
        root = tmp_path / "results"
        (root / "tables").mkdir(parents=True, exist_ok=True)
        if clips is not None:
            (root / "tables" / "clips.csv").write_text(clips, encoding="utf-8")
        results = evaluate_claims(claims, root) if results is None else results
        path = tmp_path / "report.html"
        settings = {"results_root": root, "config_name": "full", "data_kind": "captured"}
        write_report(path, results, **(settings | options))
        return path.read_text(encoding="utf-8")

    return run


def test_page_holds_every_claim_with_its_rule(render, claims):
    text = render()
    page = Page(text)
    ids = {attributes.get("id") for attributes in page.all("tr")}
    for claim in claims:
        assert claim.id in ids
        assert " ".join(claim.claim.split()) in page.words, claim.id
        assert claim.paper_value in page.words, claim.id
        assert claim.rule_text() in page.words, claim.id


def test_page_takes_nothing_from_outside(render, tmp_path):
    (tmp_path / "a.svg").write_bytes(SVG)
    text = render(clips=CLIPS, figures=[(tmp_path / "a.svg", "A figure")])
    assert "http" not in text
    page = Page(text)
    assert not page.all("script")
    assert not page.all("link")
    assert all(a["href"].startswith("#") for a in page.all("a"))
    assert all(image["src"].startswith("data:") for image in page.all("img"))
    assert "url(" not in text


def test_links_within_the_page_have_targets(render):
    page = Page(render())
    ids = {attributes["id"] for _, attributes in page.tags if "id" in attributes}
    targets = {a["href"][1:] for a in page.all("a")}
    assert len(targets) >= 6
    assert targets <= ids


def test_what_run_this_is(render):
    page = Page(
        render(results_root="results/full", data_kind="captured and planted", title="A <b>")
    )
    assert "results results/full configuration full data captured and planted" in page.words
    assert page.words.count("A <b>") == 2
    assert not page.all("b")


def test_failed_clips_come_first_with_their_reasons_escaped(render):
    text = render(clips=CLIPS)
    assert "joint &lt;b&gt;LeftFoot&lt;/b&gt; &amp; frame 3" in text
    words = Page(text).words
    assert "1 of 3 clips failed." in words
    assert words.index("LeftFoot") < words.index("Ledger of claims Every verdict")
    assert "embedded 3 1 1.5 Medians" in words


def test_good_clips_and_no_clips(render):
    good = CLIPS.replace("failed", "ok")
    assert "All 3 clips went through." in Page(render(clips=good)).words
    assert (
        "No summary of the clips: clips.csv: no column status."
        in Page(render(clips="id\n1\n")).words
    )


def test_clips_table_that_is_missing(tmp_path):
    assert summarise_clips(tmp_path / "clips.csv").problem == "clips.csv: the table does not exist"


def test_reasons_in_the_ledger_are_escaped(render, claims):
    result = ClaimResult(claims[0], {}, "not yet measured", "", "<script>alert(1)</script>")
    text = render([result])
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text
    assert not Page(text).all("script")


def test_verdicts_are_told_in_words_counted_and_marked(render, claims):
    measured = next(c for c in claims if c.id == "nio-F5")
    values = dict.fromkeys(measured.metrics, 0.05)
    results = [ClaimResult(measured, values, "replicated", "planted", "")]
    results += [ClaimResult(claims[0], {}, verdict, "captured", "") for verdict in VERDICTS[1:]]
    page = Page(render(results))
    classes = [a["class"] for a in page.all("span") if "badge" in a.get("class", "")]
    for verdict in VERDICTS:
        # one in the heading's counts, one in the table's head, one in the claim's own row
        assert classes.count(f"badge {verdict.replace(' ', '-')}") == 3
        assert re.search(rf"\W 1 {verdict}\b", page.words)
    assert "gap = 0.05" in page.words
    assert "planted data" in page.words
    assert "-0.009 (-15.3 %)" in page.words


def test_a_changed_rule_shows(render, claims):
    plain = ClaimResult(claims[0], {}, "not yet measured", "", "none")
    changed = replace(plain, claim=replace(claims[0], changed=("2030-01-02",)))
    assert "rule changed on 2030-01-02" in Page(render([changed])).words
    assert "rule changed on" not in Page(render([plain])).words


def test_figures_are_embedded_with_caption_and_alternative_text(render, tmp_path):
    (tmp_path / "a.png").write_bytes(PNG)
    (tmp_path / "b.svg").write_bytes(SVG)
    page = Page(render(figures=[(tmp_path / "a.png", 'Walk "A"'), (tmp_path / "b.svg", "Run")]))
    images = page.all("img")
    assert [image["alt"] for image in images] == ['Figure 1: Walk "A"', "Figure 2: Run"]
    assert [base64.b64decode(i["src"].partition(",")[2]) for i in images] == [PNG, SVG]
    assert '1. Walk "A"' in page.words
    assert not Page(render()).all("figure")


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.pdf", b"%PDF", ".png and .svg figures only"),
        ("a.png", b"", "not a image/png file"),
        ("a.svg", b"<html>", "not a image/svg"),
        ("a.png", None, "cannot be read: No such file"),
    ],
)
def test_figures_that_are_none(tmp_path, name, content, said):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(MotionStyleError, match=re.escape(said)):
        embed_image(tmp_path / name)


def test_a_bad_figure_leaves_the_former_page(render, tmp_path):
    before = render()
    with pytest.raises(MotionStyleError):
        render(figures=[(tmp_path / "none.png", "None")])
    assert (tmp_path / "report.html").read_text(encoding="utf-8") == before


def test_two_runs_give_the_same_bytes(render):
    assert render(clips=CLIPS) == render(clips=CLIPS)


def test_every_table_scrolls_in_its_own_container(render):
    text = render(clips=CLIPS)
    tables = len(re.findall(r"<table", text))
    assert tables == 7
    assert len(re.findall(r'<div class="scroll"[^>]*>\s*<table', text)) == tables
