#!/usr/bin/env python3
"""Compares tables that `lgvi convert` has made, value by value, with what `rosbags` reads from the bag.

    lgvi convert BAG --format parquet --json > REPORT
    check_tables.py BAG REPORT           # prints the number of compared values

CSV is read by Python's own reader, Parquet by DuckDB. Exits with 1 and says where they differ.
"""

import argparse
import csv
import json
import struct
import sys
from pathlib import Path

import duckdb
import numpy
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from ruamel.yaml import YAML

from check_bag import Disagreement, plain

NUMBERS = {"bool", "float32", "float64", *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64))}
PARQUET_TYPES = {
    "timestamp": "TIMESTAMPTZ_NS",
    "bool": "BOOLEAN",
    "int8": "TINYINT",
    "int16": "SMALLINT",
    "int32": "INTEGER",
    "int64": "BIGINT",
    "uint8": "UTINYINT",
    "uint16": "USMALLINT",
    "uint32": "UINTEGER",
    "uint64": "UBIGINT",
    "float32": "FLOAT",
    "float64": "DOUBLE",
    "string": "VARCHAR",
    "JSON": "VARCHAR",
    "bytes": "BLOB",
}


def without_padding(value):
    """A message without the octet that stands for no fields."""
    if isinstance(value, dict):
        return {
            name: without_padding(element)
            for name, element in value.items()
            if name != "structure_needs_at_least_one_member"
        }
    if isinstance(value, list):
        return [without_padding(element) for element in value]
    return value


def messages(bag):
    """(log time, publish time, sequence, value) of each message by topic, definitions taken from the bag."""
    by_topic = {}
    with AnyReader([bag]) as reader:
        for file in sorted(bag.glob("*.mcap")):
            with file.open("rb") as stream:
                for schema, channel, message in make_reader(stream).iter_messages(log_time_order=True):
                    value = without_padding(plain(reader.deserialize(message.data, schema.name)))
                    times = message.log_time, message.publish_time, message.sequence
                    by_topic.setdefault(channel.topic, []).append((*times, value))
    return by_topic


def flat(value, path=()):
    """(path, value) of each leaf: what is no dictionary and no list, and empty ones."""
    if isinstance(value, dict):
        for name, element in value.items():
            yield from flat(element, (*path, name))
    elif isinstance(value, list) and value:
        for index, element in enumerate(value):
            yield from flat(element, (*path, str(index)))
    elif isinstance(value, list):
        yield path, value
    else:
        yield path, value


def at(value, path):
    """What lies at a path."""
    for segment in path:
        value = value[int(segment)] if isinstance(value, list) else value[segment]
    return value


def number_of(kind, text):
    """A number of CSV or JSON."""
    if kind == "bool":
        return {"true": True, "false": False}[text] if isinstance(text, str) else text
    return float(text) if kind.startswith("float") else int(text)


def csv_rows(path, columns):
    """Rows of a CSV file as values of their types."""

    def value(kind, text):
        if kind in NUMBERS:
            return number_of(kind, text)
        if kind == "timestamp":
            return int(text)
        if kind == "bytes":
            return bytes.fromhex(text)
        if kind.startswith("list of "):
            element = kind.removeprefix("list of ")
            return [number_of(element, item) if element in NUMBERS else item for item in json.loads(text)]
        return text

    with path.open(newline="", encoding="utf-8") as stream:
        reader = csv.reader(stream, strict=True)
        heading = next(reader)
        if heading != [column["name"] for column in columns]:
            raise Disagreement(f"{path}: columns {heading}")
        for row in reader:
            yield [value(column["type"], text) for column, text in zip(columns, row, strict=True)]


def parquet_rows(path, columns):
    """Rows of a Parquet file, whose columns must have exactly the types that are claimed."""
    table = duckdb.read_parquet(str(path))
    for column, name, kind in zip(columns, table.columns, table.types, strict=True):
        element = column["type"].removeprefix("list of ")
        expected = PARQUET_TYPES[element] + ("[]" if element != column["type"] else "")
        if (name, str(kind)) != (column["name"], expected):
            raise Disagreement(f"{path}: {name} is {kind}, expected {column['name']}, {expected}")
    names = (column["name"].replace('"', '""') for column in columns)
    selected = (
        f'epoch_ns("{name}")' if column["type"] == "timestamp" else f'"{name}"'
        for column, name in zip(columns, names)
    )
    return duckdb.sql(f"SELECT {', '.join(selected)} FROM '{path}'").fetchall()


def metadata_of(bag):
    """(definition by topic, custom data) of a bag."""
    definitions = {}
    for file in bag.glob("*.mcap"):
        with file.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        for channel in summary.channels.values():
            definitions[channel.topic] = summary.schemas[channel.schema_id].data.decode()
    metadata = YAML(typ="safe").load((bag / "metadata.yaml").read_text())
    return definitions, metadata["rosbag2_bagfile_information"].get("custom_data") or {}


def check_metadata(table, definition, custom):
    """What a Parquet file tells of itself."""
    query = f"SELECT key, value FROM parquet_kv_metadata('{table['file']}')"
    found = {key.decode(): value.decode() for key, value in duckdb.sql(query).fetchall()}
    expected = {"topic": table["topic"], "type": table["type"], "definition": definition}
    for key, value in expected.items():
        if found[key] != value:
            raise Disagreement(f"{table['file']}: {key} is {found[key]!r}, expected {value!r}")
    if not found["type_hash"].startswith("RIHS01_"):
        raise Disagreement(f"{table['file']}: type hash {found['type_hash']!r}")
    if json.loads(found["custom_data"]) != custom:
        raise Disagreement(f"{table['file']}: custom data {found['custom_data']}, expected {custom}")


def same(kind, expected, found, where):
    """Compares a cell with a value of the message; floats by their bits."""
    if kind.startswith("list of "):
        if len(expected) != len(found):
            raise Disagreement(f"{where}: {len(found)} elements, expected {len(expected)}")
        for index, pair in enumerate(zip(expected, found)):
            same(kind.removeprefix("list of "), *pair, f"{where}.{index}")
        return
    if kind == "JSON":
        same_json(expected, json.loads(found), where)
        return
    if kind == "bytes":
        expected = bytes(expected)
    if kind == "float32":
        expected, found = (float(numpy.float32(value)) for value in (expected, found))
    if kind.startswith("float"):
        expected, found = (struct.pack("<d", value) if value == value else "NaN" for value in (expected, found))
    if expected != found or (isinstance(expected, bool) and not isinstance(found, bool)):
        raise Disagreement(f"{where}: {found!r}, expected {expected!r}")


def same_json(expected, found, where):
    """Compares a JSON text with a value of the message."""
    if isinstance(expected, dict):
        if list(expected) != list(found):
            raise Disagreement(f"{where}: {list(found)}, expected {list(expected)}")
        for name in expected:
            same_json(expected[name], found[name], f"{where}.{name}")
    elif isinstance(expected, list) and isinstance(found, str):
        same("bytes", expected, bytes.fromhex(found), where)
    elif isinstance(expected, list):
        if len(expected) != len(found):
            raise Disagreement(f"{where}: {len(found)} elements, expected {len(expected)}")
        for index, pair in enumerate(zip(expected, found)):
            same_json(*pair, f"{where}.{index}")
    elif isinstance(expected, float):
        # A float32 has fewer digits.
        kind = "float64" if float(found) == expected else "float32"
        same(kind, expected, float(found), where)
    else:
        same("", expected, found, where)


def check_columns(columns, value, where):
    """Every leaf of a message is in exactly one column."""
    paths = {tuple(column["name"].split(".")) for column in columns[3:]}
    for path, leaf in flat(value):
        owners = [path[:length] for length in range(1, len(path) + 1) if path[:length] in paths]
        # A message without fields has no column, and nothing to say.
        if len(owners) != 1:
            raise Disagreement(f"{where}: {'.'.join(path)} ({leaf!r}) is in {len(owners)} columns")


def check(bag, report):
    """Compares all tables; returns how many values."""
    expected = messages(bag)
    definitions, custom = metadata_of(bag)
    rows_of = csv_rows if report["format"] == "csv" else parquet_rows
    if report["left_out"]:
        raise Disagreement(f"left out: {report['left_out']}")
    missing = set(expected) - {table["topic"] for table in report["files"]}
    if missing:
        raise Disagreement(f"no table of {missing}")
    compared = 0
    for table in report["files"]:
        columns = table["columns"]
        rows = list(rows_of(Path(table["file"]), columns))
        records = expected.get(table["topic"], [])
        if len(rows) != len(records) or len(rows) != table["rows"]:
            raise Disagreement(f"{table['file']}: {len(rows)} rows, expected {len(records)}, told {table['rows']}")
        if report["format"] == "parquet":
            check_metadata(table, definitions[table["topic"]], custom)
        for number, (row, record) in enumerate(zip(rows, records)):
            where = f"{table['file']}, row {number}"
            if tuple(row[:3]) != record[:3]:
                raise Disagreement(f"{where}: {row[:3]}, expected {record[:3]}")
            value = record[3]
            check_columns(columns, value, where)
            for column, cell in zip(columns[3:], row[3:]):
                name = column["name"]
                same(column["type"], at(value, name.split(".")), cell, f"{where}: {name}")
                compared += 1
    return compared


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("bag", type=Path)
    parser.add_argument("report", type=Path)
    arguments = parser.parse_args()
    try:
        print(check(arguments.bag, json.loads(arguments.report.read_text())))
    except Disagreement as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
