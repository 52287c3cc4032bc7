#!/usr/bin/env python3
"""Checks scenes by their JSON Schema.

    lgvi schema > SCHEMA
    check_schema.py SCHEMA SCENE...      # prints the number of misspelled scenes, all of which the schema refuses

Each scene must satisfy the schema, and must not if any one of its keys is misspelled. Exits with 1 and says which does not.
"""

import copy
import datetime
import json
import sys
import tomllib
from pathlib import Path

from jsonschema import Draft202012Validator


def plain(value):
    """The value as JSON has it: times become texts, as in TOML language servers."""
    match value:
        case dict():
            return {key: plain(inner) for key, inner in value.items()}
        case list():
            return [plain(inner) for inner in value]
        case datetime.datetime() | datetime.date() | datetime.time():
            return value.isoformat()
        case _:
            return value


def keys(value, path=()):
    """The paths of all keys."""
    match value:
        case dict():
            for key, inner in value.items():
                yield (*path, key)
                yield from keys(inner, (*path, key))
        case list():
            for index, inner in enumerate(value):
                yield from keys(inner, (*path, index))


def misspelled(scene, path):
    """The scene with a letter more in a key."""
    scene = copy.deepcopy(scene)
    table = scene
    for part in path[:-1]:
        table = table[part]
    table[f"{path[-1]}x"] = table.pop(path[-1])
    return scene


def main():
    schema = json.loads(Path(sys.argv[1]).read_text())
    Draft202012Validator.check_schema(schema)
    validator = Draft202012Validator(schema)
    refused = 0
    for file in sys.argv[2:]:
        scene = plain(tomllib.loads(Path(file).read_text()))
        for error in validator.iter_errors(scene):
            sys.exit(f"{file}: {error.json_path}: {error.message}")
        # The same key in another element of an array is checked once.
        shapes = {tuple(0 if isinstance(part, int) else part for part in path): path for path in keys(scene)}
        for path in shapes.values():
            if validator.is_valid(misspelled(scene, path)):
                sys.exit(f"{file}: the schema accepts a misspelled {path}")
            refused += 1
    print(refused)


if __name__ == "__main__":
    main()
