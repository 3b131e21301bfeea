#!/bin/sh
# The byte 200 in a bag is -56 for one of two readers where its type is `byte`, and for the other where it is `char`.
#
# Setting: an MCAP file as ROS 2 records it, with one std_msgs/msg/Byte and one std_msgs/msg/Char. Each message has the
# same one byte, 0xc8.
# Guess: 200 for both types and both readers, as ROS 2 makes `char` an uint8 and `byte` an octet of IDL
# (rosidl_adapter/msg/__init__.py, MSG_TYPE_TO_IDL); if a reader takes them as signed, then both types alike.
# Seen, with the versions below, from the Python Package Index:
#   rosbags            byte -56 (it reads int8), char 200
#   mcap-ros2-support  byte 200, char -56 (mcap_ros2/_dynamic.py reads it as int8)
# Both refuse to write what the other one reads, so that a bag cannot be copied from one to the other by its values.
# Fails if one of these changes. Needs Python 3.11 and some 20 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile rosbags==0.11.9 mcap==1.6.0 mcap-ros2-support==0.6.0 numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import io
import sys
from pathlib import Path

from mcap.writer import Writer
from mcap_ros2.reader import read_ros2_messages
from mcap_ros2.writer import Writer as ValueWriter
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

path = Path(sys.argv[1], "bag.mcap")
store = get_typestore(Stores.ROS2_JAZZY)
with open(path, "wb") as file:
    writer = Writer(file)
    writer.start(profile="ros2")
    for kind in ("Byte", "Char"):
        schema = writer.register_schema(f"std_msgs/msg/{kind}", "ros2msg", f"{kind.lower()} data\n".encode())
        channel = writer.register_channel(f"/{kind.lower()}", "cdr", schema)
        writer.add_message(channel, log_time=1, publish_time=1, data=bytes.fromhex("00010000c8"))
    writer.finish()

with open(sys.argv[1] + "/seen", "w") as seen:
    with AnyReader([path], default_typestore=store) as reader:
        for connection, _, data in reader.messages():
            print("rosbags:", connection.topic, reader.deserialize(data, connection.msgtype).data, file=seen)
    for each in read_ros2_messages(str(path)):
        print("mcap-ros2-support:", each.channel.topic, each.ros_msg.data, file=seen)
    try:
        store.serialize_cdr(store.types["std_msgs/msg/Byte"](200), "std_msgs/msg/Byte")
    except Exception as error:
        print("rosbags writes a byte of 200:", type(error).__name__, file=seen)
    writer = ValueWriter(io.BytesIO())
    schema = writer.register_msgdef("std_msgs/msg/Char", "char data")
    try:
        writer.write_message("/char", schema, {"data": 200}, log_time=1, publish_time=1)
    except Exception as error:
        print("mcap-ros2-support writes a char of 200:", type(error).__name__, file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
rosbags: /byte -56
rosbags: /char 200
mcap-ros2-support: /byte 200
mcap-ros2-support: /char -56
rosbags writes a byte of 200: error
mcap-ros2-support writes a char of 200: error
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
