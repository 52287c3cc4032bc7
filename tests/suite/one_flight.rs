//! Two flights in one domain.

use lgvi_tests::{Recording, Summary, World, scene};

#[test]
fn a_second_flight_in_a_domain_is_refused_and_leaves_the_first_alone() {
    let world = World::new();
    let arguments = ["--real-time-factor", "0.3"];
    let first = world.start_flight(&scene("inclination_change"), "first", &arguments);
    world.await_step(30);
    let second = world
        .start_flight(&scene("free_body"), "second", &[])
        .finish()
        .expect(2);
    let domain = format!(
        "domain {} has a flight under way",
        world.environment().domain_id
    );
    second.says(&[
        &domain,
        &format!("process {}: ", first.pid()),
        "inclination_change.toml into ",
        "expected none",
    ]);
    assert!(!world.path("second").exists());

    let summary: Summary = first.finish().expect(0).json();
    assert_eq!(summary.lost, Some(0));
    let states = Recording::read(&world.path("first"))
        .on("/lgvi_propagator/state")
        .count();
    assert_eq!(states, 1001);
    world.verify_agrees(&world.path("first"), states as u64);
    world.fly(&scene("free_body"), "second");
}
