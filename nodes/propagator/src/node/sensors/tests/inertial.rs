//! What inertial sensors read, against mechanics.

use super::*;

const ZERO: [f64; 3] = [0.0; 3];

/// An IMU at the center of `craft` and one in the frame `arm`, which is read first.
fn imus(period: f64) -> String {
    sensor(
        "imu",
        "out",
        &format!("frame = \"arm\"\nperiod = {period:?}"),
    ) + &sensor("imu", "center", &format!("period = {period:?}"))
}

#[track_caller]
fn assert_near(found: Vector3<f64>, expected: [f64; 3], error: f64) {
    let difference = (found - Vector3::from(expected)).norm();
    assert!(
        difference < error,
        "{found} for {expected:?}: {difference:e}"
    );
}

/// `f = Ω × (Ω × r)`, whatever the period: here the body turns by 1.5 rad in one.
#[test]
fn a_body_that_turns_uniformly_pulls_a_lever_inwards() {
    let craft = body("craft", &place(ZERO, ZERO, [0.0, 0.0, 3.0]), &imus(0.5));
    let mut flight = Run::new(&run(0.01, &format!("{craft}{}", arm([0.3, 0.4, 7.0]))));
    let mut all: Vec<_> = flight.begin();
    all.extend(flight.steps(200).into_iter().map(|(_, reading)| reading));
    assert_eq!(all.len(), 10);
    for reading in all {
        let [rate, force] = inertial(&reading);
        // The axes of the arm are x, z and −y of the body.
        if reading.sensor == 0 {
            assert_near(rate, [0.0, 3.0, 0.0], 1e-12);
            assert_near(force, [-2.7, 0.0, 3.6], 1e-11);
        } else {
            assert_near(rate, [0.0, 0.0, 3.0], 1e-12);
            assert_near(force, ZERO, 1e-15);
        }
    }
}

/// The axes of the sensor turn with the body by the rotation vector that it reads.
#[test]
fn rates_of_a_tumbling_body_add_up_to_its_attitude() {
    let craft = body("craft", &place(ZERO, ZERO, [1.0, 2.0, -1.5]), &imus(0.2));
    let mut flight = Run::new(&run(0.01, &format!("{craft}{}", arm([0.0; 3]))));
    flight.begin();
    let mut attitude = flight.flight.states()[0].attitude;
    for (_, reading) in flight.steps(1000) {
        if reading.sensor == 1 {
            attitude *= lgvi_lie::exp(&(0.2 * inertial(&reading)[0]));
        }
    }
    let error = (attitude - flight.flight.states()[0].attitude).norm();
    assert!(error < 1e-12, "{error:e}");
}

/// On an eccentric orbit with steps of a minute, too.
#[test]
fn free_fall_reads_zero() {
    let orbit = "orbit = { semi_major_axis = 1e7, eccentricity = 0.3 }\nangular_velocity = [0, 0, 1e-3]\nattitude = { w = 1, x = 0, y = 0, z = 0 }";
    let craft = body("craft", orbit, &sensor("imu", "imu", "period = 120.0"));
    let mut flight = Run::new(&run(
        60.0,
        &format!("{craft}[gravity.central]\nbody = \"earth\"\n"),
    ));
    flight.begin();
    let all = flight.steps(1000);
    assert_eq!(all.len(), 500);
    for (_, reading) in all {
        let [rate, force] = inertial(&reading);
        // The velocity is rounded to 1e-12 m/s.
        assert!(force.norm() < 1e-13, "{force}");
        assert!((rate - Vector3::new(0.0, 0.0, 1e-3)).norm() < 1e-12);
    }
}

/// In the middle of the period the drag is the mean, but for the square of the angle on the orbit.
#[test]
fn drag_is_felt() {
    let orbit = "orbit = { semi_major_axis = 6571e3, inclination = \"50 deg\" }\nangular_velocity = [0, 0, 0]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\ndrag = { area = 4.0 }";
    let craft = body("craft", orbit, &sensor("imu", "imu", "period = 20.0"));
    let air =
        "[gravity.central]\nbody = \"earth\"\n[gravity.central.atmosphere]\nbody = \"earth\"\n";
    let mut flight = Run::new(&run(1.0, &format!("{craft}{air}")));
    flight.begin();
    for _ in 0..20 {
        assert!(flight.steps(10).is_empty());
        let body = &flight.flight.system().bodies()[0];
        let expected = body.drag_force(&flight.flight.states()[0]) / body.mass();
        let (_, reading) = flight.steps(10).pop().unwrap();
        let [_, force] = inertial(&reading);
        let error = (force - expected).norm() / expected.norm();
        assert!(expected.norm() > 1e-4 && error < 1e-4, "{force}: {error:e}");
    }
}

/// By the definition: increments of the velocity less the integral of gravity by Simpson's rule, which are not what the
/// sensor computes.
#[test]
fn thrust_in_orbit_is_the_increment_of_velocity_less_gravity() {
    let start = place([7e6, 0.0, 0.0], [0.0, 7.5e3, 0.0], [0.0, 0.0, 0.02]);
    let craft = body("craft", &start, &imus(2.0));
    let text = run(
        0.5,
        &format!(
            "{craft}{}[gravity.central]\ngm = 3.986e14\n",
            arm([0.0, 3.0, 0.0])
        ),
    );
    let text = text.replace(
        "integrator = { name = \"lgvi\", rotor = \"exact\" }",
        "integrator = { name = \"nystrom\", order = 8 }",
    );
    let mut flight = Run::new(&text);
    flight.command(0, [0.3, -0.1, 0.2], [1e-3, 2e-3, -1e-3], "craft");
    flight.begin();
    let lever = Vector3::new(0.0, 3.0, 0.0);
    let gravity = |x: &Vector3<f64>| -3.986e14 * x / x.norm().powi(3);
    for _ in 0..50 {
        let (mut states, mut read) = (Vec::new(), Vec::new());
        for _ in 0..=4 {
            states.push(flight.flight.states()[0]);
            if states.len() <= 4 {
                read = flight.step();
            }
        }
        let bodies = &flight.scene.bodies[0].body;
        let velocity = |k: usize| {
            let state = &states[k];
            state.velocity(bodies) + state.attitude * state.angular_velocity(bodies).cross(&lever)
        };
        let fall: Vector3<f64> = [1.0, 4.0, 2.0, 4.0, 1.0]
            .iter()
            .zip(&states)
            .map(|(weight, state)| gravity(&state.position) * (weight * 0.5 / 3.0))
            .sum();
        let mean = (velocity(4) - velocity(0) - fall) / 2.0;
        // In the axes in the middle of the turn: J_l(θ)⁻¹ R₀ᵀ differs from that by (θ/2)²/6.
        let half = 0.5 * lgvi_lie::log(&states[0].attitude.tr_mul(&states[4].attitude));
        let middle = states[0].attitude * lgvi_lie::exp(&half);
        let force = middle.tr_mul(&mean);
        let found = inertial(&read[0])[1];
        let found = Vector3::new(found.x, -found.z, found.y);
        let error = 0.25 * half.norm_squared() * force.norm() + 1e-9;
        assert!((found - force).norm() < error, "{found} {force}");
    }
}

/// `F/m` at the center of mass, in the axes of the body; at a lever `α × r + Ω × (Ω × r)` beside it.
#[test]
fn thrust_reads_its_force_and_a_moment_its_acceleration() {
    let craft = body("craft", &place(ZERO, ZERO, ZERO), &imus(0.01));
    let mut flight = Run::new(&run(0.01, &format!("{craft}{}", arm([0.0, 4.0, 0.0]))));
    flight.command(0, [3.0, 0.0, 0.0], [0.0, 0.0, 5.0], "craft");
    flight.begin();
    // α = 2 rad/s² about z.
    for k in 0..100 {
        let readings = flight.step();
        let rate = 0.02 * (k as f64 + 0.5);
        let [out, center] = [&readings[0], &readings[1]].map(inertial);
        assert_near(center[0], [0.0, 0.0, rate], 1e-9);
        // The force is constant in the inertial axes over a step, in which the body turns by 0.02 rad at most.
        assert_near(center[1], [1.5, 0.0, 0.0], 0.02);
        let force = out[1] - Vector3::new(center[1].x, center[1].z, -center[1].y);
        assert_near(force, [-8.0, 0.0, 4.0 * rate * rate], 1e-3);
    }
}

#[test]
fn a_force_in_the_axes_of_the_body_is_read_in_them() {
    let craft = body("craft", &place(ZERO, ZERO, [0.0, 0.0, 0.5]), &imus(0.01));
    let mut flight = Run::new(&run(0.01, &format!("{craft}{}", arm([0.0; 3]))));
    flight.command(0, [3.0, 1.0, 0.0], ZERO, "craft");
    flight.begin();
    for (_, reading) in flight.steps(300) {
        if reading.sensor == 1 {
            assert_near(inertial(&reading)[1], [1.5, 0.5, 0.0], 0.005);
        }
    }
}

/// What is held does not fall: it reads the force that holds it.
#[test]
fn bodies_that_do_not_fall_read_their_support() {
    let gravity = "[gravity.uniform]\nacceleration = [0.0, 0.0, -9.8]\n";
    let attitude = "attitude = { w = 1, x = 0, y = 0, z = 0 }";
    let at_rest = format!("position = [0, 0, 0]\nmobility = \"fixed\"\n{attitude}");
    let pivoted = format!(
        "position = [0, 0, 0]\nmobility = \"pivoted\"\npoints = [{{ mass = 2.0, position = [0, 0, -0.1] }}]\nangular_velocity = [0, 0, 0]\n{attitude}"
    );
    let circling = format!(
        "position = [3, 0, 0]\nmobility = {{ circle = {{ center = [0, 0, 0], rate = [0, 0, 2] }} }}\n{attitude}"
    );
    for (how, expected) in [
        (at_rest, [0.0, 0.0, 9.8]),
        (pivoted, [0.0, 0.0, 9.8]),
        // 3 m and 0.5 m of the lever from the center.
        (circling, [-12.0, -2.0, 9.8]),
    ] {
        let craft = body("craft", &how, &imus(0.1));
        let mut flight = Run::new(&run(
            0.01,
            &format!("{craft}{}{gravity}", arm([0.0, 0.5, 0.0])),
        ));
        let [x, y, z] = expected;
        let mut all = flight.begin();
        all.extend(flight.steps(100).into_iter().map(|(_, reading)| reading));
        for reading in all.iter().filter(|reading| reading.sensor == 0) {
            assert_near(inertial(reading)[1], [x, z, -y], 1e-10);
        }
    }
}

/// A lander of 2 kg held at 10 m from the center of an asteroid that is held, too: gravity between them moves neither.
#[test]
fn a_lander_on_what_does_not_move_reads_its_support() {
    let held = |x: f64| {
        format!(
            "position = [{x:?}, 0, 0]\nmobility = \"fixed\"\nattitude = {{ w = 1, x = 0, y = 0, z = 0 }}"
        )
    };
    let lander = body("craft", &held(10.0), &imus(0.1));
    let asteroid = body("asteroid", &held(0.0), "");
    let gravity = "[gravity.mutual]\nconstant = 50.0\n";
    let text = format!("{lander}{asteroid}{}{gravity}", arm([0.0; 3]));
    let mut flight = Run::new(&run(0.01, &text));
    let mut all = flight.begin();
    all.extend(flight.steps(20).into_iter().map(|(_, reading)| reading));
    assert!(!all.is_empty());
    for reading in all.iter().filter(|reading| reading.sensor == 0) {
        // 50 × 2 / 10².
        assert_near(inertial(reading)[1], [1.0, 0.0, 0.0], 1e-12);
    }
}

/// Two bodies of 2 kg that join: the impact, and then the thrust of the other one.
#[test]
fn bodies_that_have_docked_feel_the_thrust_of_each_other() {
    let craft = body(
        "craft",
        &place([-1.05, 0.0, 0.0], [0.5, 0.0, 0.0], ZERO),
        &imus(0.1),
    );
    let station = body("station", &place([1.0, 0.0, 0.0], ZERO, ZERO), "");
    let docking = "[[docking]]\nports = [\n{ body = \"craft\", position = [1, 0, 0], axis = [1, 0, 0] },\n{ body = \"station\", position = [-1, 0, 0], axis = [-1, 0, 0] },\n]\ndistance = 0.01\n";
    let mut flight = Run::new(&run(
        0.01,
        &format!("{craft}{station}{}{docking}", arm([0.0; 3])),
    ));
    flight.command(1, [0.0, 0.0, 0.4], ZERO, "");
    flight.begin();
    let (mut gain, mut before) = (0.0, true);
    for (step, reading) in flight.steps(40) {
        let force = inertial(&reading)[1];
        if reading.sensor == 0 {
            continue;
        }
        gain += 0.1 * force.x;
        if flight.flight.docked().is_empty() || step <= flight.flight.docked()[0].step {
            assert_near(force, ZERO, 1e-12);
        } else if before {
            before = false;
        } else {
            // 0.4 N on 4 kg, 1 m off their center, where the moment of inertia is 8 kg m²; the lever of the craft is 1 m.
            assert_near(force, [0.0, 0.0, 0.1 - 0.05], 0.002);
        }
    }
    assert!(!before);
    // Half of the speed is lost at once.
    assert!((gain + 0.25).abs() < 0.01, "{gain}");
}
