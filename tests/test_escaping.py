"""Foreign text is text and nothing else in every target, by the target's own reader."""

from __future__ import annotations

import html
import json
import shutil
import subprocess
from html.parser import HTMLParser

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fogml.escaping import CCode, c_text, cell_text, figure_text, markup, script_data, terminal_text, visible


def test_a_figure_keeps_its_sign_and_size_where_an_encoding_lacks_them() -> None:
    told = {name: terminal_text("ä −0.5 ± 7.1 × 10⁻⁵ m/s² …", name) for name in ("utf-8", "latin-1", "ascii")}
    assert told["utf-8"] == "ä −0.5 ± 7.1 × 10⁻⁵ m/s² …"
    assert told["latin-1"] == "ä -0.5 ± 7.1 × 10^-5 m/s² ..."
    assert told["ascii"] == "? -0.5 +/- 7.1 x 10^-5 m/s^2 ..."


NASTY = st.lists(
    st.sampled_from(
        ["*/", "/*", "*", "/", "//", "\\", "??/", "?", '"', "'", "<", ">", "&", "=1+1", "@", "#", "é"]
    )
    | st.sampled_from(["</script>", "<!--", "]]>", "system(1);"])
    | st.sampled_from(["\n", "\x1b[2J", "\x00", "\r", "\u202e", "\u2028", "\ud800"])
    | st.text(max_size=3),
    max_size=12,
).map("".join)


@given(NASTY)
@settings(max_examples=300)
def test_nothing_ends_a_comment_of_c(text):
    shown = c_text(text)
    assert all(" " <= c <= "~" for c in shown) and "\\" not in shown
    assert all(mark not in shown for mark in ("*/", "/*", "??"))


@pytest.mark.skipif(shutil.which("gcc") is None, reason="gcc is not installed")
def test_the_preprocessor_finds_nothing_but_comments():
    texts = ["p */ int x; /*", "a*\n/ int y;", "*??/\n/ int z;", "// \\", "é*\u2028/"]
    source = "".join(f"/* {c_text(text)} */\n" for text in texts)
    done = subprocess.run(
        ["gcc", "-E", "-P", "-trigraphs", "-x", "c", "-"],
        input=source,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.strip() == ""


def test_own_c_is_left_alone():
    assert c_text(CCode("#define A 1 /* one */")) == "#define A 1 /* one */"


class Reader(HTMLParser):
    """Collects elements and text of a page."""

    def __init__(self):
        super().__init__()
        self.elements, self.text, self.attributes = [], "", []

    def handle_starttag(self, tag, attrs):
        self.elements.append(tag)
        self.attributes += attrs

    def handle_data(self, data):
        self.text += data


@given(NASTY)
@settings(max_examples=300)
def test_markup_is_one_text_to_a_reader_of_html(text):
    reader = Reader()
    reader.feed(f'<p title="{markup(text)}">{markup(text)}</p>')
    reader.close()
    assert reader.elements == ["p"] and len(reader.attributes) == 1
    assert reader.text == reader.attributes[0][1]
    assert html.unescape(str(markup(text))) == terminal_text(text)


@given(NASTY)
@settings(max_examples=300)
def test_data_in_a_script_stays_itself(text):
    data = json.dumps({"name": text}, ensure_ascii=False)
    page = str(script_data(data))
    assert "<" not in page and json.loads(page) == {"name": text}


@given(NASTY)
@settings(max_examples=300)
def test_a_terminal_is_not_commanded(text):
    for shown in (visible(text), terminal_text(text), cell_text(text), figure_text(text)):
        assert all(c.isprintable() or c in "\n\t" or c.isspace() for c in shown)
        shown.encode("utf-8")
    assert "\n" not in visible(text)


def test_figures_show_marks_as_they_are():
    assert figure_text("<b>a</b> & 'b'") == "&lt;b&gt;a&lt;/b&gt; &amp; 'b'"


def test_a_cell_holds_what_a_workbook_can():
    assert len(cell_text("x" * 40_000)) == 32_767
