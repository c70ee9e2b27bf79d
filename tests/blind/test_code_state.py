"""The state of the code: what moves it, and what does not."""

from __future__ import annotations

from pathlib import Path

from fogml.blind.methods import code_state


def test_the_state_of_the_code_is_that_of_what_answers(tmp_path: Path) -> None:
    package = tmp_path / "fogml"
    for name in ("gap/found.py", "report/page.py", "blind/scoring/table.py", "twin/nominal.yaml"):
        (package / name).parent.mkdir(parents=True, exist_ok=True)
        (package / name).write_text("x = 1\n")
    first = code_state("bic", package=package)
    assert len(first) == 16 and code_state("bic", package=package) == first
    for name in ("report/page.py", "blind/scoring/table.py", "cli.txt"):
        (package / name).write_text("x = 2\n")
        assert code_state("bic", package=package) == first
    seen = {first}
    for name in ("gap/found.py", "twin/nominal.yaml", "gap/new.py", "reporting.py"):
        (package / name).write_text("x = 3\n")
        seen.add(code_state("bic", package=package))
    assert len(seen) == 5
    (tmp_path / "own.py").write_text("y = 1\n")
    own = code_state("own:method", tmp_path, package)
    assert own not in seen and code_state("bic", tmp_path, package) in seen
    (tmp_path / "own.py").write_text("y = 2\n")
    assert code_state("own:method", tmp_path, package) != own
    assert code_state("bic") == code_state("bic")
