//! The bags of the repository: what an earlier version has flown, this one repeats to the last bit.

use lgvi_tests::{Recording, World, root};

#[test]
fn reference_bags_verify() {
    let world = World::new();
    for name in ["inclination_change", "orbital_capture"] {
        let bag = root().join("bags").join(name);
        assert!(
            bag.exists(),
            "{} is missing; bags/regenerate makes it",
            bag.display()
        );
        let states = Recording::read(&bag).on("/lgvi_propagator/state").count();
        assert_eq!(states, 1001, "states of {name}");
        world.verify_agrees(&bag, 1001);
    }
}
