//! Bags of others.

use lgvi_tests::World;

#[test]
fn a_strangers_bag_of_a_strangers_type_is_played_to_a_stranger() {
    let world = World::new();
    let bag = world.path("foreign");
    let path = bag.to_str().unwrap();
    let writer = world.python("foreign_bag.py", &["write", path, "200"]);
    writer.finish().expect(0);
    let listener = world.python("foreign_bag.py", &["listen", "/readings", "200"]);
    let line = [
        "play",
        path,
        "--rate",
        "0",
        "--await-subscribers",
        "1",
        "--remap",
        "/robot/readings:=/readings",
    ];
    let player = world.lgvi(line);
    let heard = listener.finish().expect(0).stdout;
    player.finish().expect(0);
    let heard: Vec<serde_json::Value> = heard
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    let thirds = |count: u64| (0..count).map(|third| third as f64 / 3.0);
    let expected: Vec<serde_json::Value> = (0..200)
        .map(|number| {
            let values: Vec<f64> = thirds(number % 4).collect();
            serde_json::json!({"number": number, "unit": "m/s", "values": values})
        })
        .collect();
    assert_eq!(heard, expected);
}
