"""Reads point artefacts with the reference MCAP reader and decodes every message with the schema
stored in the file. Usage: read_mcap.py FILE.mcap [FILE.mcap ...]; needs mcap, mcap-protobuf-support."""

import json
import struct
import sys

from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

SIZES = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i", 7: "f", 8: "d"}


def check(path):
    with open(path, "rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header = next(
            json.loads(m.metadata["json"])
            for m in reader.iter_metadata()
            if m.name == "timberline.header"
        )
        points = 0
        for schema, _channel, _message, cloud in reader.iter_decoded_messages():
            assert schema.name == "foxglove.PointCloud", schema.name
            names = [field.name for field in cloud.fields]
            assert names[:3] == ["x", "y", "z"], names
            for field in cloud.fields:
                assert field.offset + struct.calcsize(SIZES[field.type]) <= cloud.point_stride
            assert len(cloud.data) % cloud.point_stride == 0
            points += len(cloud.data) // cloud.point_stride
    expected = header["facts"]["counts"]["points"]
    assert points == expected, f"{points} points, header says {expected}"
    print(f"{path}: {points} points, {len(names)} fields")


for argument in sys.argv[1:]:
    check(argument)
