"""The counts of the house on a small one whose figures are known."""

from __future__ import annotations

from pathlib import Path

from experiments.house.counting import circles, counted

SOURCE = '''"""Two lines
of words."""

LEAST = -3.0
_MOST = 2 * 60
NAMES = ("a",)
lower = 1.0
WIDE: int = 4


def told(x: float) -> float:
    """What."""
    # Why.
    return x


class Thing:
    def bare(self, y):
        text = """not
a docstring"""
        return y, text

    def _own(self): ...
'''


def test_a_file_is_counted_as_by_hand(tmp_path: Path) -> None:
    path = tmp_path / "one.py"
    path.write_text(SOURCE, encoding="utf-8")
    found = counted(path)
    assert (found.lines, found.docstring, found.blank) == (23, 3, 6)
    assert found.code == 23 - 3 - 6 - 1
    assert found.constants == 3
    assert (found.public, found.documented, found.typed) == (3, 1, 2)
    assert found.longest == (4, "one.py: told") or found.longest == (4, "one.py: bare")


def test_each_circle_is_found_once(tmp_path: Path) -> None:
    root = tmp_path / "house"
    for package, imported in {"a": "b", "b": "c", "c": "a", "d": "a"}.items():
        (root / package).mkdir(parents=True)
        text = f"def f():\n    from house.{imported} import x\n"
        (root / package / "x.py").write_text(text, encoding="utf-8")
    (ring,) = circles(root)
    assert set(ring.split(" → ")) == {"a", "b", "c"}
    (root / "c" / "x.py").write_text("from house import other\n", encoding="utf-8")
    assert circles(root) == []
