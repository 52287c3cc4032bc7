//! The options of a maneuver, the problems that they compile to, and the errors for invalid combinations.

use std::f64::consts::FRAC_PI_2;

use lgvi_control::constraint::{
    AngularRate, CommandLimit, ComponentLimit, Corridor, KeepOutCone, KeepOutEllipsoid,
    KeepOutSphere, LineOfSight, NormLimit, Place, Plume, Speed,
};
use lgvi_control::terminal::{FinalAttitude, FinalPosition, KeplerOrbit, SpinAxis};
use lgvi_control::{Constraint, Dynamics, Motion, Terminal};
use lgvi_dynamics::integrator::Rotor;
use lgvi_dynamics::{BodyState, Load, Method};
use lgvi_lie::exp;
use lgvi_scene::{
    Commands, FinalTime, Integration, Maneuver, Minimize, Replan, Scene, Search, SolverMethod,
};
use nalgebra::{Matrix3, Vector3};

use crate::{BODY, RUN, assert_refused, with};

const STATE: &str = "position = [3, 1, 0]\nvelocity = [0, 1, 0]\nattitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0.1, 0, 0]";

/// Returns a scene whose maneuver has these keys and this target.
fn text(keys: &str, target: &str) -> String {
    format!(
        "{RUN}\n[gravity.central]\ngm = 4.0\n[[bodies]]\nname = \"craft\"{BODY}\n\
         [maneuver]\nbody = \"craft\"\n{keys}\n[maneuver.target]\n{target}\n"
    )
}

fn parse(keys: &str, target: &str) -> Scene {
    let text = text(keys, target);
    Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

fn maneuver(keys: &str, target: &str) -> Maneuver {
    parse(keys, target).maneuver.unwrap()
}

#[test]
fn what_the_target_leaves_out_is_free() {
    let momentum = Vector3::new(0.0, 2.0, 0.0);
    let position = Vector3::new(3.0, 1.0, 0.0);
    let attitude = Matrix3::identity();
    let z = Vector3::z();
    let identity = "attitude = { w = 1, x = 0, y = 0, z = 0 }";
    let at = |momentum| FinalPosition::new(position, momentum).expect("a position");
    let turned = |momentum| FinalAttitude::new(attitude, momentum).expect("an attitude");
    let orbit = KeplerOrbit::new(4.0, Vector3::zeros(), 2.0, position, Vector3::y());
    let spin = SpinAxis::new(z, z, 5.0 * z).expect("a spin axis");
    let free = Terminal::FREE;
    for (target, expected) in [
        (
            STATE,
            free.clone()
                .with(at(Some(momentum)))
                .with(turned(Some(Vector3::new(0.1, 0.0, 0.0)))),
        ),
        ("position = [3, 1, 0]", free.clone().with(at(None))),
        (identity, free.clone().with(turned(None))),
        (
            "orbit = { position = [3, 1, 0], velocity = [0, 1, 0] }\n\
             spin_axis = { axis = [0, 0, 2], direction = [0, 0, 5] }\nangular_velocity = [0, 0, 2]",
            free.with(orbit.expect("an orbit")).with(spin),
        ),
    ] {
        assert_eq!(maneuver("", target).target, expected, "{target}");
    }
}

#[test]
fn constraints_are_compiled_one_by_one() {
    let keys = "constraints = [\n\
        { kind = \"force_components\", limit = [1, 2, 3] }, { kind = \"moment_components\", limit = 0.5 },\n\
        { kind = \"force_norm\", limit = 4 }, { kind = \"moment_norm\", limit = 5 },\n\
        { kind = \"keep_out_cone\", axis = [3, 0, 0], direction = [0, 4, 0], half_angle = 0.25 },\n\
        { kind = \"keep_out_sphere\", center = [1, 2, 3], radius = 0.5 },\n\
        { kind = \"corridor\", apex = [3, 1, 0], axis = [0, 0, 9], half_angle = 0.3 },\n\
        { kind = \"commands\", limit = 7 }]";
    let [x, y, z] = [Vector3::x(), Vector3::y(), Vector3::z()];
    let [force, moment] = [Place::Position, Place::Attitude];
    let components = |place, limit| ComponentLimit::new(place, limit).map(Constraint::commands);
    let norm = |place, limit| NormLimit::new(place, limit).map(Constraint::commands);
    let corner = Vector3::new(1.0, 2.0, 3.0);
    let corridor = Corridor::new(Vector3::new(3.0, 1.0, 0.0), z, 0.3);
    let expected = [
        components(force, corner),
        components(moment, Vector3::from_element(0.5)),
        norm(force, 4.0),
        norm(moment, 5.0),
        KeepOutCone::new(x, y, 0.25).map(Constraint::state),
        KeepOutSphere::new(corner, 0.5).map(Constraint::state),
        corridor.map(Constraint::state),
        CommandLimit::new(&[7.0; 6]).map(Constraint::commands),
    ]
    .map(|constraint| constraint.expect("a constraint"));
    assert_eq!(maneuver(keys, STATE).constraints, expected);
}

#[test]
fn limits_on_rates_ellipsoids_sights_and_plumes_are_read_with_their_prices() {
    let keys = "constraints = [\
        { kind = \"angular_rate\", limit = 0.5 }, { kind = \"angular_rate\", limit = 0.5, axis = [0, 0, 2] },\
        { kind = \"speed\", limit = 3.0, price = 7.0 },\
        { kind = \"keep_out_ellipsoid\", center = [1, 2, 3], semi_axes = [1, 2, 4] },\
        { kind = \"keep_out_ellipsoid\", center = [1, 2, 3], semi_axes = [1, 2, 4], attitude = { w = 0, x = 0, y = 0, z = 1 } },\
        { kind = \"line_of_sight\", axis = [2, 0, 0], point = [1, 2, 3], half_angle = \"90 deg\" },\
        { kind = \"plume\", axis = [2, 0, 0], point = [1, 2, 3], half_angle = 0.25, distance = 4 },\
        { kind = \"force_norm\", limit = 4, price = 2.0 }]";
    let maneuver = maneuver(keys, STATE);
    let body = &parse(keys, STATE).bodies[0].body;
    let corner = Vector3::new(1.0, 2.0, 3.0);
    let semi_axes = Vector3::new(1.0, 2.0, 4.0);
    let half_turn = Matrix3::from_diagonal(&Vector3::new(-1.0, -1.0, 1.0));
    let rate = AngularRate::new(0.5, body.inertia()).expect("a rate");
    let ellipsoid = |axes| KeepOutEllipsoid::new(corner, semi_axes, axes).map(Constraint::state);
    let norm = NormLimit::new(Place::Position, 4.0).map(Constraint::commands);
    let expected = [
        Ok(Constraint::state(rate)),
        rate.about(Vector3::z()).map(Constraint::state),
        Speed::new(3.0, body.mass()).and_then(|speed| Constraint::state(speed).priced(7.0)),
        ellipsoid(Matrix3::identity()),
        ellipsoid(half_turn),
        LineOfSight::new(Vector3::x(), corner, FRAC_PI_2).map(Constraint::state),
        Plume::new(Vector3::x(), corner, 0.25, 4.0).map(Constraint::state),
        norm.and_then(|norm| norm.priced(2.0)),
    ]
    .map(|constraint| constraint.expect("a constraint"));
    assert_eq!(maneuver.constraints, expected);
    assert_eq!(maneuver.constraints[2].price(), Some(7.0));
    assert_ne!(
        maneuver.constraints[2],
        Constraint::state(Speed::new(3.0, body.mass()).expect("a speed"))
    );
}

#[test]
fn constraints_out_of_range_are_refused_with_their_keys() {
    for (text, key) in [
        ("kind = \"angular_rate\", limit = 0", "constraints[0].limit"),
        (
            "kind = \"angular_rate\", limit = 1, axis = [0, 0, 0]",
            "constraints[0].axis",
        ),
        ("kind = \"speed\", limit = -1.0", "constraints[0].limit"),
        (
            "kind = \"speed\", limit = 1.0, price = 0.0",
            "constraints[0].price",
        ),
        (
            "kind = \"keep_out_ellipsoid\", center = [9, 9, 9], semi_axes = [1, 0, 1]",
            "constraints[0].semi_axes",
        ),
        (
            "kind = \"keep_out_ellipsoid\", center = [9, 9, 9], semi_axes = [1, 1, 1], attitude = { w = 0, x = 0, y = 0, z = 0 }",
            "constraints[0].attitude",
        ),
        (
            "kind = \"line_of_sight\", axis = [1, 0, 0], point = [1, 2, 3], half_angle = 4.0",
            "constraints[0].half_angle",
        ),
        (
            "kind = \"plume\", axis = [1, 0, 0], point = [1, 2, 3], half_angle = 0.2, distance = 0",
            "constraints[0].distance",
        ),
    ] {
        let keys = format!("constraints = [{{ {text} }}]");
        assert_refused(&self::text(&keys, STATE), &[key]);
    }
    let turning = "motion = \"rotation\"\nconstraints = [{ kind = \"speed\", limit = 1.0 }]";
    assert_refused(
        &text(
            turning,
            "attitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0.1, 0, 0]",
        ),
        &["constraints[0].kind"],
    );
}

#[test]
fn the_spelling_of_earlier_versions_is_read() {
    let sphere = |key: &str| {
        let keys = format!(
            "constraints = [{{ kind = \"keep_out_sphere\", {key} = [1, 2, 3], radius = 0.5 }}]"
        );
        maneuver(&keys, STATE).constraints
    };
    assert_eq!(sphere("centre"), sphere("center"));
}

#[test]
fn actuators_take_the_place_of_force_and_moment() {
    let keys = "actuators = [{ force = [1, 0, 0], moment = [0, 0, 0.5], weight = 3 }, { moment = [0, 1, 0] }]\n\
                constraints = [{ kind = \"commands\", limit = [1, 2] }]";
    let maneuver = maneuver(keys, STATE);
    assert_eq!(maneuver.actuation.commands(), 2);
    let matrix = maneuver.actuation.matrix();
    assert_eq!(matrix.column(0).as_slice(), [1.0, 0.0, 0.0, 0.0, 0.0, 0.5]);
    assert_eq!(matrix.column(1).as_slice(), [0.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    assert_eq!(maneuver.actuation.weight()[(0, 0)], 3.0);
    assert_eq!(maneuver.actuation.weight()[(1, 1)], 1.0);
    let limit: &CommandLimit = maneuver.constraints[0].downcast_ref().expect("limits");
    assert_eq!(limit.limit()[..2], [1.0, 2.0]);
}

/// A chaser with two thrusters, other keys of the maneuver, and other text of the second thruster.
fn by_thrusters(keys: &str, second: &str) -> Result<Scene, String> {
    let text = format!(
        r#"
        title = "thrusters"
        [run]
        duration = 1.0
        steps = 10
        integrator = "lgvi"
        [[bodies]]
        name = "chaser"
        mass = 2.0
        inertia = [1, 1, 1]
        position = [0, 0, 0]
        velocity = [0, 0, 0]
        attitude = {{ w = 1, x = 0, y = 0, z = 0 }}
        angular_velocity = [0, 0, 0]
        [[bodies.thrusters]]
        name = "first"
        position = [0, 2, 0]
        direction = [3, 0, 0]
        thrust = 0.5
        {second}
        [maneuver]
        body = "chaser"
        {keys}
        [maneuver.target]
        position = [1, 0, 0]
        "#
    );
    Scene::parse("test", &text).map_err(|error| error.to_string())
}

const SECOND: &str = "[[bodies.thrusters]]\nname = \"second\"\nposition = [0, 0, 0]\ndirection = [0, 1, 0]\nthrust = 4";

#[test]
fn thrusters_are_commands_with_their_places_and_limits() {
    let scene = by_thrusters("commands = \"thrusters\"\nthruster_weight = [3, 5]", SECOND).unwrap();
    let maneuver = scene.maneuver.as_ref().unwrap();
    assert!(maneuver.by_thrusters());
    let actuation = &maneuver.actuation;
    assert_eq!(actuation.commands(), 2);
    let matrix = actuation.matrix();
    assert_eq!(matrix.column(0).as_slice(), [1.0, 0.0, 0.0, 0.0, 0.0, -2.0]);
    assert_eq!(matrix.column(1).as_slice(), [0.0, 1.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(actuation.weight().diagonal().as_slice()[..2], [3.0, 5.0]);
    let limits = CommandLimit::new(&[0.5, 4.0]).map(CommandLimit::one_sided);
    assert!(maneuver.constraints.is_empty());
    let limits = limits.map(Constraint::commands).ok();
    assert_eq!(maneuver.actuator_limit, limits);
    assert_eq!(
        maneuver.effort_cost([2.0, 1.0].into_iter(), 0.1),
        0.05 * (3.0 * 4.0 + 5.0)
    );
    let scheme = scene.scheme().unwrap();
    assert_eq!(scene.flown_otherwise(scheme), None);
    let pulses = format!("{SECOND}\nminimum_impulse = 0.01");
    let scene = by_thrusters("commands = \"thrusters\"", &pulses).unwrap();
    assert!(scene.flown_otherwise(scheme).unwrap().contains("pulses"));
}

#[test]
fn what_does_not_fit_thrusters_is_refused_with_its_key() {
    let many: String = (0..15)
        .map(|index| SECOND.replace("second", &format!("thruster_{index}")) + "\n")
        .collect();
    let wheel = "[[bodies.wheels]]\nname = \"wheel\"\naxis = [0, 0, 1]\ninertia = 0.1";
    let with = "commands = \"thrusters\"";
    let uses = &format!("{SECOND}\nexhaust_velocity = 2000\n[bodies.propellant]\nmass = 0.1");
    for (keys, second, expected) in [
        (
            "",
            SECOND,
            "a body without `thrusters`, where `commands` is not \"thrusters\"",
        ),
        (with, wheel, "a body without `wheels`"),
        (with, &many, "a body with at most 15 thrusters"),
        (
            "commands = \"thrusters\"\nthruster_weight = [1]",
            SECOND,
            "one number, or 2 of them",
        ),
        (
            "commands = \"thrusters\"\nthruster_weight = -1",
            SECOND,
            "maneuver.thruster_weight",
        ),
        (
            "commands = \"thrusters\"\nforce_weight = 1",
            SECOND,
            "maneuver.force_weight",
        ),
        (
            "commands = \"thrusters\"\nfeedback = true",
            uses,
            "maneuver.feedback",
        ),
        (
            "commands = \"thrusters\"\nmotion = \"translation\"",
            SECOND,
            "maneuver.motion",
        ),
        (
            "commands = \"thrusters\"\ndynamics = \"lie_euler\"",
            SECOND,
            "maneuver.dynamics",
        ),
        (
            with,
            &format!("{uses}\ninertia = [0.001, 0.001, 0.001]"),
            "bodies.propellant.inertia",
        ),
        (
            "commands = \"thrusters\"\nfinal_time = { min = 0.5, max = 1.0 }",
            uses,
            "maneuver.final_time",
        ),
        (
            "commands = \"thrusters\"\ncost = \"fuel\"\nthruster_weight = 2",
            uses,
            "maneuver.thruster_weight",
        ),
        (
            "commands = \"thrusters\"\ncost = \"fuel\"",
            uses,
            "one of every thruster, or of none",
        ),
        (
            &format!("{with}\nconstraints = [{{ kind = \"force_components\", limit = 1 }}]"),
            SECOND,
            "maneuver.constraints[0].kind",
        ),
        (
            with,
            &format!("{SECOND}\n[disturbance]\nseed = 1\nforce_error = 0.1"),
            "disturbance.force_error",
        ),
        (
            with,
            &format!("{SECOND}\n[ensemble]\nseed = 1\nsamples = 2\nmoment_error = 0.1"),
            "ensemble.moment_error",
        ),
        (
            "commands = \"thrusters\"\nreplan = { every = 5, deadline = 1.0 }",
            &format!("{SECOND}\n[disturbance]\nseed = 1\nactuator_error = 0.1"),
            "disturbance.actuator_error",
        ),
        (
            "commands = \"thrusters\"\nprocessed = true",
            SECOND,
            "maneuver.commands",
        ),
        (
            "commands = \"thrusters\"\nsolver = { method = \"shooting\" }",
            SECOND,
            "where `solver.method` is",
        ),
        ("commands = \"wheels\"", SECOND, "a body with `wheels`"),
    ] {
        let refused = by_thrusters(keys, second).err().unwrap_or_default();
        assert!(refused.contains(expected), "{keys}: {refused}");
    }
}

/// The shipped spacecraft with other text of its engine and of its maneuver.
fn by_engine(engine: [&str; 2], keys: &str) -> Result<Scene, String> {
    let text = include_str!("../../../../scenes/earth_mars.toml");
    let changed = text.replace(engine[0], engine[1]);
    let changed = changed.replace("motion = \"translation\"", keys);
    Scene::parse("test", &changed).map_err(|error| error.to_string())
}

const THRUST: &str = "thrust = 0.5e-3";

#[test]
fn an_engine_limits_the_force_at_the_price_of_its_flow() {
    let given = "motion = \"translation\"";
    let scene = by_engine([THRUST, THRUST], given).unwrap();
    let maneuver = scene.maneuver.as_ref().unwrap();
    assert_eq!(maneuver.commands(), Commands::Loads);
    let limit = NormLimit::new(Place::Position, 0.5e-3).map(Constraint::commands);
    assert_eq!(maneuver.actuator_limit, limit.ok());
    let push = Load {
        force: Vector3::new(0.0, 3e-4, 4e-4),
        moment: Vector3::zeros(),
    };
    let cost = maneuver.interval_cost(&push, 2.0);
    assert!((cost - 2.0 * 5e-4 / 19.6133).abs() < 1e-18);

    let unlimited = by_engine([THRUST, ""], given).err();
    assert!(
        unlimited
            .unwrap()
            .contains("a constraint that limits command 0")
    );
    let limit = "constraints = [{ kind = \"force_norm\", limit = 1e-3 }]";
    let limited = by_engine([THRUST, ""], &format!("{given}\n{limit}")).unwrap();
    assert_eq!(limited.maneuver.unwrap().actuator_limit, None);
}

#[test]
fn what_does_not_fit_an_engine_is_refused_with_its_key() {
    let plain = [THRUST, THRUST];
    let tank = "propellant = { mass = 450.0 }";
    let with = |key: &str| format!("motion = \"translation\"\n{key}");
    for (engine, keys, expected) in [
        ([THRUST, "thrust = -1"], with(""), "engine.thrust"),
        (
            ["exhaust_velocity = 19.6133", "exhaust_velocity = 0"],
            with(""),
            "engine.exhaust_velocity",
        ),
        ([tank, ""], with(""), "propellant"),
        (
            [tank, "propellant = { mass = 1000.0 }"],
            with(""),
            "propellant.mass",
        ),
        (
            [
                tank,
                "propellant = { mass = 450.0, inertia = [1e-4, 1e-4, 1e-4] }",
            ],
            with(""),
            "bodies.propellant.inertia",
        ),
        (
            [
                "[maneuver]",
                "[[bodies.thrusters]]\nname = \"one\"\nposition = [0, 0, 0]\ndirection = [1, 0, 0]\nthrust = 1\n[maneuver]",
            ],
            with(""),
            "none beside `thrusters`",
        ),
        (plain, with("force_weight = 1"), "maneuver.force_weight"),
        (plain, with("feedback = true"), "maneuver.feedback"),
        (plain, with("dynamics = \"lie_euler\""), "maneuver.dynamics"),
        (
            plain,
            with("actuators = [{ force = [1, 0, 0] }]"),
            "maneuver.actuators",
        ),
        (
            plain,
            with("final_time = { min = 1e7, max = 3e7 }"),
            "maneuver.final_time",
        ),
        (plain, with("confidence = 0.9"), "maneuver.confidence"),
        (
            [
                "[maneuver]",
                "[disturbance]\nseed = 1\nforce_error = 0.01\n[maneuver]",
            ],
            with("replan = { every = 40, deadline = 1 }"),
            "disturbance.force_error",
        ),
        (
            plain,
            with("commands = \"thrusters\""),
            "a body with `thrusters`",
        ),
    ] {
        let refused = by_engine(engine, &keys).err().unwrap_or_default();
        assert!(refused.contains(expected), "{engine:?} {keys}: {refused}");
    }
}

/// A satellite with two wheels, other keys of the maneuver, and other text of the second wheel.
fn by_wheels(keys: &str, second: &str) -> Result<Scene, String> {
    let text = format!(
        r#"
        title = "wheels"
        [run]
        duration = 1.0
        steps = 10
        integrator = "lgvi"
        [[bodies]]
        name = "satellite"
        mass = 2.0
        inertia = [1, 1, 1]
        position = [0, 0, 0]
        velocity = [0, 0, 0]
        attitude = {{ w = 1, x = 0, y = 0, z = 0 }}
        angular_velocity = [0, 0, 0]
        [[bodies.wheels]]
        name = "first"
        axis = [0, 2, 0]
        inertia = 0.01
        max_torque = 0.5
        {second}
        [maneuver]
        body = "satellite"
        {keys}
        [maneuver.target]
        attitude = {{ w = 0, x = 0, y = 1, z = 0 }}
        "#
    );
    Scene::parse("test", &text).map_err(|error| error.to_string())
}

const SECOND_WHEEL: &str = "[[bodies.wheels]]\nname = \"second\"\naxis = [1, 0, 0]\ninertia = 0.01";
const WITH_WHEELS: &str = "commands = \"wheels\"\nmotion = \"rotation\"";

#[test]
fn wheels_are_commands_with_their_axes_and_limits() {
    let scene = by_wheels(
        &format!("{WITH_WHEELS}\nwheel_weight = [3, 5]"),
        SECOND_WHEEL,
    )
    .unwrap();
    let maneuver = scene.maneuver.as_ref().unwrap();
    assert_eq!(maneuver.commands(), Commands::Wheels);
    let actuation = &maneuver.actuation;
    assert!(actuation.is_of_wheels() && actuation.commands() == 2);
    let matrix = actuation.matrix();
    assert_eq!(matrix.column(0).as_slice(), [0.0, 0.0, 0.0, 0.0, -1.0, 0.0]);
    assert_eq!(matrix.column(1).as_slice(), [0.0, 0.0, 0.0, -1.0, 0.0, 0.0]);
    let limits = CommandLimit::new(&[0.5, f64::INFINITY]).map(Constraint::commands);
    assert_eq!(maneuver.actuator_limit, limits.ok());
    assert_eq!(
        maneuver.effort_cost([2.0, 1.0].into_iter(), 0.1),
        0.05 * (3.0 * 4.0 + 5.0)
    );
}

#[test]
fn what_does_not_fit_wheels_is_refused_with_its_key() {
    let many: String = (0..15)
        .map(|index| SECOND_WHEEL.replace("second", &format!("wheel_{index}")) + "\n")
        .collect();
    let given = |keys: &str| format!("{WITH_WHEELS}\n{keys}");
    for (keys, second, expected) in [
        ("", SECOND_WHEEL, "where `commands` is not \"wheels\""),
        (WITH_WHEELS, SECOND, "a body without `thrusters`"),
        (WITH_WHEELS, &many, "a body with at most 15 wheels"),
        (
            &given("wheel_weight = [1]"),
            SECOND_WHEEL,
            "one number, or 2 of them",
        ),
        (
            &given("wheel_weight = 0"),
            SECOND_WHEEL,
            "maneuver.wheel_weight",
        ),
        (
            &given("thruster_weight = 1"),
            SECOND_WHEEL,
            "maneuver.thruster_weight",
        ),
        (
            &given("moment_weight = 1"),
            SECOND_WHEEL,
            "maneuver.moment_weight",
        ),
        (
            &given("feedback = true\nreplan = { every = 5, deadline = 1.0 }"),
            SECOND_WHEEL,
            "maneuver.feedback",
        ),
        (
            &given("dynamics = \"lie_euler\""),
            SECOND_WHEEL,
            "maneuver.dynamics",
        ),
        (
            &given("final_time = { min = 0.5, minimize = \"time\" }"),
            SECOND_WHEEL,
            "expected one of wheel \"second\" beside",
        ),
        ("commands = \"wheels\"", SECOND_WHEEL, "maneuver.motion"),
        (
            WITH_WHEELS,
            &format!("{SECOND_WHEEL}\nviscous_friction = 1e-6"),
            "bodies.wheels.viscous_friction",
        ),
        (
            WITH_WHEELS,
            &format!("{SECOND_WHEEL}\ncoulomb_friction = 1e-6"),
            "bodies.wheels.coulomb_friction",
        ),
        (
            WITH_WHEELS,
            &format!("{SECOND_WHEEL}\n[disturbance]\nseed = 1\nmoment_error = 0.1"),
            "disturbance.moment_error",
        ),
        (
            WITH_WHEELS,
            &format!("{SECOND_WHEEL}\n[ensemble]\nseed = 1\nsamples = 2\nactuator_error = -0.1"),
            "ensemble.actuator_error",
        ),
    ] {
        let refused = by_wheels(keys, second).err().unwrap_or_default();
        assert!(refused.contains(expected), "{keys}: {refused}");
    }
}

#[test]
fn options_are_what_the_file_says_and_modest_unless_it_does() {
    let plain = maneuver("", STATE);
    assert_eq!(plain.solver.method, SolverMethod::Newton);
    assert_eq!((plain.motion, plain.processed), (Motion::Full, false));
    assert_eq!(
        (plain.search, plain.replan, plain.final_time),
        (None, None, None)
    );
    assert!(!plain.feedback && plain.constraints.is_empty());

    let keys = "search = { starts = 16, seed = 7 }\nreplan = { every = 10, deadline = 0.25 }\nfeedback = true";
    let rich = maneuver(keys, STATE);
    assert_eq!(
        rich.search,
        Some(Search {
            starts: 16,
            seed: 7
        })
    );
    let replan = Replan {
        every: 10,
        deadline: 0.25,
    };
    assert_eq!((rich.replan, rich.feedback), (Some(replan), true));
    let rotation = "motion = \"rotation\"\nconstraints = [{ kind = \"moment_norm\", limit = 1 }]";
    let target = "attitude = { w = 1, x = 0, y = 0, z = 0 }";
    assert_eq!(maneuver(rotation, target).motion, Motion::Rotation);
}

/// With 100 steps of 0.01, bounds between two steps are rounded inwards.
#[test]
fn a_final_time_is_a_whole_number_of_steps() {
    let final_time = |keys: &str| maneuver(keys, STATE).final_time.unwrap();
    let found = final_time("final_time = { min = 0.305, max = 0.5, weight = 2 }");
    let expected = FinalTime {
        min_steps: 31,
        max_steps: 50,
        weight: 2.0,
        minimize: Minimize::Cost,
    };
    assert_eq!(found, expected);
    let keys = "motion = \"rotation\"\nsearch = { starts = 2 }\nfinal_time = { min = 0.305, minimize = \"time\" }\n\
                constraints = [{ kind = \"moment_norm\", limit = 1 }]";
    let turn = "attitude = { w = 1, x = 0, y = 0, z = 0 }\nangular_velocity = [0, 0, 0]";
    assert_eq!(
        maneuver(keys, turn).final_time.unwrap().minimize,
        Minimize::Time
    );
    let found = final_time("final_time = { min = 0.29 }");
    assert_eq!((found.min_steps, found.max_steps), (29, 100));
    let scene = parse("final_time = { min = 0.2, max = 0.8 }", STATE);
    assert_eq!(scene.transfer().unwrap().unwrap().intervals(), 80);
    let state = scene.bodies[0].state;
    let rest = scene.transfer_from(state, 7).unwrap().unwrap();
    assert_eq!((rest.intervals(), rest.h()), (7, scene.h()));
}

/// The plan uses the dynamics of the scene's integrator, and an automatic integrator becomes the method of the plan.
#[test]
fn a_plan_obeys_the_dynamics_that_fly_it() {
    let rotor = Rotor::default();
    for (integrator, keys, dynamics, method, otherwise) in [
        ("\"lgvi\"", "", Dynamics::Lgvi, Method::Lgvi(rotor), None),
        (
            "\"lie_euler\"",
            "",
            Dynamics::LieEuler,
            Method::LieEuler(rotor),
            None,
        ),
        ("\"auto\"", "", Dynamics::Lgvi, Method::Lgvi(rotor), None),
        (
            "\"auto\"",
            "dynamics = \"lie_euler\"",
            Dynamics::LieEuler,
            Method::LieEuler(rotor),
            None,
        ),
        (
            "\"auto\"",
            "solver = { method = \"shooting\" }",
            Dynamics::LieEuler,
            Method::LieEuler(rotor),
            None,
        ),
        (
            "\"auto\"",
            "dynamics = \"lgvi\"",
            Dynamics::Lgvi,
            Method::Lgvi(rotor),
            None,
        ),
        (
            "\"auto\"",
            "processed = true",
            Dynamics::LieEuler,
            Method::Lgvi(rotor),
            None,
        ),
        (
            "\"lgvi\"",
            "processed = true",
            Dynamics::LieEuler,
            Method::Lgvi(rotor),
            None,
        ),
        (
            "\"lgvi\"",
            "dynamics = \"lie_euler\"",
            Dynamics::LieEuler,
            Method::Lgvi(rotor),
            Some("Lie–Euler"),
        ),
        (
            "\"runge_kutta4\"",
            "",
            Dynamics::Lgvi,
            Method::RungeKutta4,
            Some("LGVI"),
        ),
    ] {
        let text = with(
            &text(keys, STATE),
            "integrator = \"lgvi\"",
            &format!("integrator = {integrator}"),
        );
        let scene = Scene::parse("test", &text).unwrap();
        assert_eq!(
            scene.maneuver.as_ref().unwrap().dynamics,
            dynamics,
            "{integrator} {keys}"
        );
        assert_eq!(
            scene.integration,
            Integration::Method(method),
            "{integrator} {keys}"
        );
        let said = scene.flown_otherwise(scene.scheme().unwrap());
        assert_eq!(said.is_some(), otherwise.is_some(), "{said:?}");
        if let (Some(said), Some(planned)) = (said, otherwise) {
            assert!(
                said.contains(&format!("planned in {planned} steps")),
                "{said}"
            );
        }
    }
}

#[test]
fn wrong_maneuvers_are_named() {
    let rotation = "attitude = { w = 1, x = 0, y = 0, z = 0 }";
    for (keys, target, parts) in [
        ("", "", ["`maneuver.target` is missing", "position"]),
        (
            "",
            "velocity = [0, 1, 0]",
            ["`maneuver.target.velocity` is [0.0, 1.0, 0.0]", "position"],
        ),
        (
            "",
            "angular_velocity = [0, 1, 0]",
            ["`maneuver.target.angular_velocity`", "attitude"],
        ),
        (
            "",
            "position = [1, 0, 0]\norbit = { position = [1, 0, 0], velocity = [0, 1, 0] }",
            ["`maneuver.target.orbit`", "none beside"],
        ),
        (
            "",
            "orbit = { position = [1, 0, 0], velocity = [0, 3, 0] }",
            [
                "`maneuver.target.orbit.velocity` is [0.0, 3.0, 0.0]",
                "escape",
            ],
        ),
        (
            "",
            "orbit = { position = [1, 0, 0], velocity = [1, 0, 0] }",
            ["`maneuver.target.orbit`", "through the attractor"],
        ),
        (
            "",
            "spin_axis = { axis = [1, 0, 0], direction = [0, 0, 1] }",
            ["`maneuver.target.angular_velocity` is missing", "spin_axis"],
        ),
        (
            "",
            "spin_axis = { axis = [0, 0, 0], direction = [0, 0, 1] }\nangular_velocity = [0, 0, 0]",
            ["`maneuver.target.spin_axis.axis`", "not zero"],
        ),
        (
            "motion = \"rotation\"",
            STATE,
            ["`maneuver.target.position`", "not planned"],
        ),
        (
            "motion = \"translation\"",
            rotation,
            ["`maneuver.target.attitude`", "not planned"],
        ),
        (
            "motion = \"rotation\"\nconstraints = [{ kind = \"force_norm\", limit = 1 }]",
            rotation,
            ["`maneuver.constraints[0].kind` is \"force_norm\"", "motion"],
        ),
        (
            "motion = \"rotation\"\nactuators = [{ force = [1, 0, 0] }]",
            rotation,
            ["`maneuver.actuators[0].force`", "not planned"],
        ),
        (
            "constraints = [{ kind = \"force_norm\", limit = -1 }]",
            STATE,
            ["`maneuver.constraints[0].limit` is -1.0", "> 0"],
        ),
        (
            "constraints = [{ kind = \"force_components\", limit = [1, 2] }]",
            STATE,
            ["`maneuver.constraints[0].limit` is [1.0, 2.0]", "3 of them"],
        ),
        (
            "constraints = [{ kind = \"corridor\", apex = [0, 0, 0], axis = [0, 0, 1], half_angle = 2 }]",
            STATE,
            ["`maneuver.constraints[0].half_angle` is 2.0", "π/2"],
        ),
        (
            "actuators = []",
            STATE,
            ["`maneuver.actuators` is 0", "1 to 15"],
        ),
        (
            "actuators = [{ weight = 2 }]",
            STATE,
            ["`maneuver.actuators[0]`", "not zero"],
        ),
        (
            "actuators = [{ force = [1, 0, 0], weight = 0 }]",
            STATE,
            ["`maneuver.actuators[0].weight` is 0.0", "> 0"],
        ),
        (
            "actuators = [{ force = [1, 0, 0] }]\nforce_weight = 1",
            STATE,
            ["`maneuver.force_weight`", "actuators"],
        ),
        (
            "final_time = { min = 0.5, max = 1.5 }",
            STATE,
            ["`maneuver.final_time.max` is 1.5", "at most 1"],
        ),
        (
            "final_time = { min = 0.5, max = 0.4 }",
            STATE,
            ["`maneuver.final_time` is [0.5, 0.4]", "whole number"],
        ),
        (
            "final_time = { min = 0.5, weight = -1 }",
            STATE,
            ["`maneuver.final_time.weight` is -1.0", "≥ 0"],
        ),
        (
            "search = { starts = 0 }",
            STATE,
            ["`maneuver.search.starts` is 0", "1 to"],
        ),
        (
            "search = { starts = 2 }\nfinal_time = { min = 0.5 }",
            STATE,
            ["`maneuver.search`", "final_time"],
        ),
        (
            "final_time = { min = 0.5, weight = 2, minimize = \"time\" }",
            STATE,
            ["`maneuver.final_time.weight` is 2.0", "minimize"],
        ),
        (
            "replan = { every = 5, deadline = 1 }\nfinal_time = { min = 0.5, minimize = \"time\" }",
            STATE,
            ["`maneuver.replan`", "nothing to correct with"],
        ),
        (
            "final_time = { min = 0.5, minimize = \"time\" }\n\
             constraints = [{ kind = \"force_components\", limit = [1, 1, 1] }]",
            STATE,
            ["`maneuver.constraints`", "the moment about x"],
        ),
        (
            "replan = { every = 0, deadline = 1 }",
            STATE,
            ["`maneuver.replan.every` is 0", "1 to 100"],
        ),
        (
            "replan = { every = 10, deadline = 0 }",
            STATE,
            ["`maneuver.replan.deadline` is 0.0", "> 0"],
        ),
        (
            "solver = { method = \"shooting\" }",
            STATE,
            ["`maneuver.dynamics` is \"lgvi\"", "shooting"],
        ),
        (
            "dynamics = \"lie_euler\"\nsolver = { method = \"shooting\" }\nfeedback = true",
            STATE,
            ["`maneuver.feedback` is true", "false where `solver.method`"],
        ),
        (
            "dynamics = \"lie_euler\"\nsolver = { method = \"shooting\" }\n",
            "position = [1, 0, 0]",
            ["`maneuver.target`", "shooting"],
        ),
        (
            "processed = true\ndynamics = \"lgvi\"",
            STATE,
            ["`maneuver.dynamics` is \"lgvi\"", "processed"],
        ),
        (
            "processed = true\nreplan = { every = 10, deadline = 1 }",
            STATE,
            ["`maneuver.replan`", "processed"],
        ),
    ] {
        assert_refused(&text(keys, target), &parts);
    }
    for (keys, part) in [
        ("motion = \"sideways\"", "sideways"),
        ("constraints = [{ kind = \"force\", limit = 1 }]", "force"),
        (
            "constraints = [{ kind = \"force_norm\", limit = 1, axis = 2 }]",
            "axis",
        ),
        ("replan = { every = 10 }", "deadline"),
        ("search = { starts = 3, seeds = 3 }", "seeds"),
    ] {
        assert_refused(&text(keys, STATE), &[part]);
    }
    let lie_euler = with(
        &text("processed = true", STATE),
        "\"lgvi\"",
        "\"lie_euler\"",
    );
    assert_refused(
        &lie_euler,
        &["`maneuver.processed` is true", "second order"],
    );
    let long = with(
        &text("feedback = true", STATE),
        "steps = 100",
        "steps = 200000",
    );
    assert_refused(&long, &["`run.steps` is 200000", "100000", "feedback"]);
    let nowhere = with(
        &text("", "orbit = { position = [1, 0, 0], velocity = [0, 1, 0] }"),
        "[gravity.central]\ngm = 4.0\n",
        "",
    );
    assert_refused(&nowhere, &["`maneuver.target.orbit`", "gravity.central"]);
}

/// Free components contribute nothing to the miss, and the others contribute their error.
#[test]
fn a_miss_is_that_of_the_target() {
    let end = |position: [f64; 3], momentum: [f64; 3], turn: Vector3<f64>, spin: Vector3<f64>| {
        BodyState {
            position: position.into(),
            linear_momentum: momentum.into(),
            attitude: exp(&turn),
            angular_momentum: spin,
        }
    };
    let turn = Vector3::new(0.2, 0.0, 0.0);
    let away = end(
        [3.0, 1.0, 0.5],
        [0.0, 2.0, 1.0],
        turn,
        Vector3::new(0.1, 0.3, 0.0),
    );
    let parts = |target: &str, end: &BodyState| {
        let miss = parse("", target).miss(end).unwrap();
        [0, 3, 6, 9].map(|row| miss.fixed_rows::<3>(row).norm())
    };
    let near = |found: [f64; 4], expected: [f64; 4]| {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-14, "{found} for {expected}");
        }
    };
    near(parts(STATE, &away), [0.5, 1.0, 0.2, 0.3]);
    near(parts("position = [3, 1, 0]", &away), [0.5, 0.0, 0.0, 0.0]);
    near(
        parts("attitude = { w = 1, x = 0, y = 0, z = 0 }", &away),
        [0.0, 0.0, 0.2, 0.0],
    );
    let spin =
        "spin_axis = { axis = [0, 0, 1], direction = [0, 0, 1] }\nangular_velocity = [0, 0, 0]";
    near(
        parts(spin, &end([0.0; 3], [0.0; 3], turn, Vector3::zeros())),
        [0.0, 0.0, 0.2, 0.0],
    );
    let about = Vector3::new(0.0, 0.0, 1.3);
    near(
        parts(spin, &end([0.0; 3], [0.0; 3], about, Vector3::zeros())),
        [0.0; 4],
    );
    let over = Vector3::new(std::f64::consts::PI, 0.0, 0.0);
    assert!(
        (parts(spin, &end([0.0; 3], [0.0; 3], over, Vector3::zeros()))[2] - 2.0 * FRAC_PI_2).abs()
            < 1e-7
    );

    // Circle of radius 4 and speed 1, mass 2. Another point on it has no miss. A speed greater by 1 % gives these
    // errors.
    let orbit = "orbit = { position = [4, 0, 0], velocity = [0, 1, 0] }";
    let there = end([0.0, 4.0, 0.0], [-2.0, 0.0, 0.0], turn, about);
    near(parts(orbit, &there), [0.0; 4]);
    let faster = end([0.0, 4.0, 0.0], [-2.02, 0.0, 0.0], turn, about);
    near(
        parts(orbit, &faster),
        [4.0 * (1.01 * 1.01 - 1.0), 0.02, 0.0, 0.0],
    );
}
