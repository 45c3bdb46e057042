"""Nothing slow is left out of the nightly parts, and each part has a last result."""

import re
from pathlib import Path

from tests.nightly import PARTS, TABLE, Row, rows, written

ROOT = Path(__file__).parents[1]


def test_every_slow_test_belongs_to_a_part():
    slow = [
        path.relative_to(ROOT)
        for path in (ROOT / "tests").rglob("test_*.py")
        if re.search(r"^(@|pytestmark = \[?).*mark\.slow", path.read_text(encoding="utf-8"), re.MULTILINE)
    ]
    assert len(slow) > 8
    places = [Path(word) for part in PARTS.values() for word in part.command if word.startswith("tests/")]
    for path in slow:
        assert any(path == place or place in path.parents for place in places), path


def test_every_part_of_the_night_has_a_last_result():
    found = rows(TABLE.read_text(encoding="utf-8"))
    assert {name for name, part in PARTS.items() if part.nightly} <= set(found) <= set(PARTS)


def test_a_table_is_read_as_it_was_written():
    row = Row("solver", "2026-11-23 18:00", "5.1", "abc1234", "19 passed, 1 xfailed in 300 s")
    other = Row("trefoils (by hand)", "2026-11-23 19:00", "30.0", "abc1234", "4 passed")
    text = written({"solver": row, "trefoils": other})
    assert rows(text) == {"solver": row, "trefoils": other}
    assert written(rows(text)) == text
