#!/usr/bin/env python3
"""Writes an MCAP file with a topic of CDR, one of JSON, and one without schema, with `mcap`.

    mixed_bag.py FILE
"""

import argparse

from mcap.writer import Writer

COUNT = 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file")
    with open(parser.parse_args().file, "xb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2")
        string = writer.register_schema("std_msgs/msg/String", "ros2msg", b"string data\n")
        status = writer.register_schema("Status", "jsonschema", b"{}")
        channels = {
            writer.register_channel("/chatter", "cdr", string): b"\0\1\0\0\6\0\0\0hello\0",
            writer.register_channel("/status", "json", status): b'{"ok": true}',
            writer.register_channel("/untyped", "cdr", 0): b"\0\1\0\0\0",
        }
        for time in range(COUNT):
            for channel, data in channels.items():
                writer.add_message(channel, time, data, time, time)
        writer.finish()


if __name__ == "__main__":
    main()
