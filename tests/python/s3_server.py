"""A server on loopback that speaks S3, with the bucket `flights`.

Prints its URL. Then each line of the standard input is answered by one of the standard output, in JSON: `list PREFIX` by the names
of the objects, `get PREFIX DIRECTORY` by their number when they are in the directory, `put NAME TEXT` by null. Serves until the input
ends.
"""

import json
import sys
from pathlib import Path

import boto3
from moto.server import ThreadedMotoServer


def main():
    server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    host, port = server.get_host_and_port()
    url = f"http://{host}:{port}"
    keys = {"aws_access_key_id": "key", "aws_secret_access_key": "secret", "region_name": "us-east-1"}
    bucket = boto3.resource("s3", endpoint_url=url, **keys).Bucket("flights")
    bucket.create()
    print(url, flush=True)

    def names(prefix):
        return [entry.key for entry in bucket.objects.filter(Prefix=prefix)]

    for line in sys.stdin:
        command, *arguments = line.split()
        answer = None
        if command == "list":
            answer = names(*arguments)
        elif command == "get":
            prefix, directory = arguments
            answer = len(names(prefix))
            for name in names(prefix):
                bucket.download_file(name, str(Path(directory, name.rpartition("/")[2])))
        elif command == "put":
            name, text = arguments
            bucket.put_object(Key=name, Body=text.encode())
        print(json.dumps(answer), flush=True)
    server.stop()


if __name__ == "__main__":
    main()
