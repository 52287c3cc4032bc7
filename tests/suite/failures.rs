//! Flights that cannot go on, though nothing is wrong with what was given.

use lgvi_tests::{Recording, Summary, World, coast, edited, publish, scene};

#[test]
fn a_step_without_solution_is_named_and_the_bag_keeps_all_before_it() {
    let world = World::new();
    let scene = scene("inclination_change");
    let flight = world.start_flight(&scene, "flight", &["--no-planner"]);
    // The body is spun up until it turns too far in one step.
    let mut spin_up = coast();
    for moment in &mut spin_up.moment {
        moment.x = 100.0;
    }
    let _publisher = publish(&world.ros_node("stranger"), &spin_up);
    let summary: Summary = flight.finish().expect(1).json();
    let message = summary.failure.unwrap().message;

    let states = Recording::read(&world.path("flight"))
        .on("/lgvi_propagator/state")
        .count();
    assert!((50..500).contains(&states), "{states} states");
    let last_step = states - 1;
    let expected = format!("propagator: step {last_step}: spacecraft: ");
    assert!(
        message.starts_with(&expected),
        "{message}, expected {expected}"
    );
    assert!(
        message.contains("past the limit of solvability"),
        "{message}"
    );
    world.verify_agrees(&world.path("flight"), states as u64);
}

#[test]
fn a_plan_that_does_not_converge_is_said() {
    let world = World::new();
    let solver = "[maneuver.solver]\nmax_iterations = 1\n\n[maneuver.target]";
    let scene = edited(
        &world,
        "inclination_change",
        &[("[maneuver.target]", solver)],
    );
    let summary: Summary = world
        .start_flight(&scene, "flight", &[])
        .finish()
        .expect(1)
        .json();
    let message = summary.failure.unwrap().message;
    assert!(
        message.starts_with("planner: no plan: not converged after "),
        "{message}"
    );
    assert!(summary.flight.is_none());
    // The flight has failed, and all of it until then is in the bag.
    assert_eq!(summary.lost, Some(0));
    assert_eq!(summary.bag, Some(world.path("flight")));
}
