"""Writes the same messages in every way that the writer of `mcap` has, and bags of `rosbags`.

    pip install -r requirements.txt
    python write_variants.py DIRECTORY  # must exist; a file or a bag for each way, whose name says which

Prints them as a JSON array of `path` and `messages`. Where there is no message the writer leaves schemas out that channels
refer to, and miscounts a checksum: what its own reader of streams does not read is left out.
"""

import io
import itertools
import json
import struct
import sys
from pathlib import Path

from mcap.exceptions import McapError
from mcap.reader import NonSeekingReader
from mcap.stream_reader import CRCValidationError
from mcap.writer import CompressionType, IndexType, Writer
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as BagWriter
from rosbags.typesys import Stores, get_typestore

START = 1_700_000_000_000_000_000
TYPE = "std_msgs/msg/String"
COUNT = 40

CHUNKS = {
    "unchunked": {"use_chunking": False},
    "none": {"compression": CompressionType.NONE},
    "lz4": {"compression": CompressionType.LZ4},
    "zstd": {"compression": CompressionType.ZSTD},
}
INDEXES = {
    "noindex": IndexType.NONE,
    "chunkindex": IndexType.CHUNK,
    "messageindex": IndexType.MESSAGE,
    "chunkmessageindex": IndexType.CHUNK | IndexType.MESSAGE,
    "otherindex": IndexType.ATTACHMENT | IndexType.METADATA,
    "allindex": IndexType.ALL,
}
SWITCHES = {
    "channels": "repeat_channels",
    "schemas": "repeat_schemas",
    "statistics": "use_statistics",
    "offsets": "use_summary_offsets",
    "crcs": "enable_crcs",
    "datacrcs": "enable_data_crcs",
}


def text(number):
    """A String as CDR."""
    content = f"message {number}".encode() + b"\0"
    return struct.pack("<BBHI", 0, 1, 0, len(content)) + content


def fill(writer, count, extras):
    """Messages on two topics, some at one time and one before its predecessor; nothing on a third."""
    schema = writer.register_schema(TYPE, "ros2msg", b"string data\n")
    channels = [writer.register_channel(f"/{name}", "cdr", schema) for name in ("one", "two", "silent")]
    for number in range(count):
        time = START + (number - number % 3 if number % 7 else number - 5)
        writer.add_message(channels[number % 2], time, text(number), time, number)
    if extras:
        writer.add_attachment(START, START, "notes", "text/plain", b"read me")
        writer.add_metadata("origin", {"made": "by hand"})
        writer.add_metadata("empty", {})


def is_readable(contents):
    """Whether the reader of streams takes a file for whole."""
    try:
        for _ in NonSeekingReader(io.BytesIO(contents), validate_crcs=True).iter_messages():
            pass
    except (McapError, CRCValidationError):
        return False
    return True


def variants(directory):
    """A file for each combination of the writer's options."""
    switches = itertools.product((True, False), repeat=len(SWITCHES))
    ways = itertools.product(CHUNKS.items(), INDEXES.items(), list(switches), (True, False), (COUNT, 0))
    for (chunks, options), (index, index_types), chosen, extras, count in ways:
        on = [name for name, is_on in zip(SWITCHES, chosen) if is_on]
        path = directory / ("_".join([chunks, index, *on, *(["extras"] if extras else []), str(count)]) + ".mcap")
        output = io.BytesIO()
        given = dict(zip(SWITCHES.values(), chosen))
        writer = Writer(output, chunk_size=300, index_types=index_types, **options, **given)
        writer.start(profile="ros2", library="variants")
        fill(writer, count, extras)
        writer.finish()
        if is_readable(output.getvalue()):
            path.write_bytes(output.getvalue())
            yield path, count


def bags(directory):
    """Bags of rosbags, of both versions."""
    store = get_typestore(Stores.ROS2_JAZZY)
    for count, version in itertools.product((0, COUNT), (8, 9)):
        bag = directory / f"rosbags_{version}_{count}"
        with BagWriter(bag, version=version, storage_plugin=StoragePlugin.MCAP) as writer:
            connection = writer.add_connection("/one", TYPE, typestore=store)
            for number in range(count):
                writer.write(connection, START + number, text(number))
        yield bag, count


def main():
    directory = Path(sys.argv[1])
    written = itertools.chain(variants(directory), bags(directory))
    json.dump([{"path": str(path), "messages": count} for path, count in written], sys.stdout)


if __name__ == "__main__":
    main()
