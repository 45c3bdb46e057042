"""The event stream of a long command, read as CI reads it."""

import json
from functools import cache

import jsonschema

from tests.explorer.command_line import explorer


def lines_of(text):
    """The object in each line."""
    return [json.loads(line) for line in text.splitlines()]


@cache
def _validator():
    return jsonschema.Draft202012Validator(json.loads(explorer("schema", "events").stdout))


def checked_events(text):
    """The events in ``text``, each by the schema that ``explorer schema events`` prints, from start to end."""
    events = lines_of(text)
    for event in events:
        _validator().validate(event)
    assert len({event["run_id"] for event in events}) == 1
    assert [event["event"] for event in events].count("end") == 1
    assert events[-1]["event"] == "end"
    times = [event["time"] for event in events]
    assert times == sorted(times)
    return events
