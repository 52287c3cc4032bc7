//! A small good bag: what seeds are made of, and what damaged metadata lie beside.

use std::{collections::BTreeMap, error::Error, fs};

use lgvi_bag::{BagOptions, BagWriter, Compression, Qos, Topic};
/// The bag's name.
pub const NAME: &str = "bag";

/// The text of its `metadata.yaml`, and its file.
pub fn bag(compression: Compression) -> Result<(String, Vec<u8>), Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let directory = folder.path().join(NAME);
    let options = BagOptions {
        compression,
        ..BagOptions::default()
    };
    let mut bag = BagWriter::create(&directory, options)?;
    let states = bag.add_topic(&topic(
        "/lgvi_propagator/state",
        "lgvi_msgs/msg/SystemState",
    ))?;
    let clock = bag.add_topic(&topic("/clock", "rosgraph_msgs/msg/Clock"))?;
    for count in 0..3_u32 {
        let time = 1_700_000_000_000_000_000 + u64::from(count);
        let number = count.to_le_bytes();
        let clock_time = [&CDR[..], &time.to_le_bytes()].concat();
        let state = [&CDR[..], &number.repeat(60)].concat();
        bag.write(states, time, time, count, &state)?;
        bag.write(clock, time, time, count, &clock_time)?;
        if count == 1 {
            bag.flush()?;
        }
    }
    bag.finish(BTreeMap::from([("lost".to_owned(), "0".to_owned())]))?;
    let text = fs::read_to_string(directory.join("metadata.yaml"))?;
    Ok((text, fs::read(directory.join("bag_0.mcap"))?))
}

/// Header of little-endian CDR. What follows it here matters to nobody.
const CDR: [u8; 4] = [0, 1, 0, 0];

fn topic(name: &str, type_name: &str) -> Topic {
    Topic {
        name: name.to_owned(),
        type_name: type_name.to_owned(),
        type_hash: format!("RIHS01_{}", "0".repeat(64)),
        definition: "# shortened\n".to_owned(),
        definition_encoding: lgvi_bag::ROS2MSG.to_owned(),
        qos: Qos::default(),
    }
}
