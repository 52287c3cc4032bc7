"""Says of each file whether the readers of `mcap`, of the stream and by the index, find in it what they find in the first.

    pip install -r requirements.txt
    python read_mutants.py ORIGINAL MUTANT...  # a line for each mutant: "same", or what is else
"""

import io
import sys
from pathlib import Path

from mcap.reader import NonSeekingReader, SeekingReader


def messages(reader, path):
    """All messages of a file with what is told of them, in an order of their own."""
    found = reader(io.BytesIO(path.read_bytes()), validate_crcs=True).iter_messages()
    return sorted(
        (
            message.log_time,
            channel.topic,
            message.sequence,
            message.publish_time,
            message.data,
            channel.message_encoding,
            sorted(channel.metadata.items()),
            schema.name,
            schema.encoding,
            schema.data,
        )
        for schema, channel, message in found
    )


def difference(reader, path, expected):
    """How what a reader finds differs, or none."""
    try:
        found = messages(reader, path)
    except Exception as error:  # whatever it is, the file is not read
        return repr(error)
    return None if found == expected else f"{len(found)} other messages"


def main():
    original, *mutants = map(Path, sys.argv[1:])
    readers = {reader: messages(reader, original) for reader in (NonSeekingReader, SeekingReader)}
    for mutant in mutants:
        differences = (difference(reader, mutant, expected) for reader, expected in readers.items())
        found = next(filter(None, differences), "same")
        print(found.replace("\n", " "))


if __name__ == "__main__":
    main()
