//! Maneuvers in phases: what scenes say of them, and plans in a low orbit.

use lgvi_control::constraint::{Moving, Region};
use lgvi_control::{NewtonSettings, Start, Transfer, solve};
use lgvi_dynamics::{BodyState, Load};
use lgvi_scene::Scene;
use nalgebra::Vector3;

use crate::assert_refused;
use crate::shipped::{shipped, shipped_text};

fn docking(edits: &[(&str, &str)]) -> String {
    edits
        .iter()
        .fold(shipped_text("phased_docking"), |text, (from, to)| {
            assert!(text.contains(from), "{from}");
            text.replace(from, to)
        })
}

#[test]
fn phases_are_whole_steps_with_constraints_and_commands_of_their_own() {
    let scene = shipped("phased_docking");
    let maneuver = scene.maneuver.as_ref().unwrap();
    let of = |index: usize| &maneuver.phases[index];
    let names: Vec<_> = maneuver.phases.iter().map(|phase| &*phase.name).collect();
    assert_eq!(names, ["approach", "hold", "dock"]);
    // The other phases leave at least 100 s to the first, and at most 140 s.
    let lengths = [0, 1, 2].map(|phase| [of(phase).min_steps, of(phase).max_steps]);
    assert_eq!(lengths, [[100, 140], [20, 20], [20, 60]]);
    assert_eq!((of(1).off.len(), &of(2).off[..]), (0, &[0][..]));
    let sphere = of(1).constraints[0].region();
    assert!(matches!(
        sphere,
        Some(Region::InsideSphere { radius: 1.0, .. })
    ));
    let moves = of(1).constraints[0].downcast_ref::<Moving>();
    assert!(moves.is_some());
    assert!(maneuver.has_free_phases());
    assert_eq!(maneuver.all_constraints().count(), 4);

    let stated = scene.constraints_from(maneuver, 10, &[120, 140]);
    let keys: Vec<_> = stated.iter().map(|one| one.key.as_str()).collect();
    let phase = |number: usize| format!("maneuver.phases[{number}].constraints[0]");
    assert_eq!(keys[0], "maneuver.constraints[0]");
    assert_eq!(keys[1..], [phase(0), phase(1), phase(2)]);
    let steps: Vec<_> = stated.iter().map(|one| one.constraint.steps()).collect();
    assert_eq!(steps, [None, Some(0..110), Some(110..130), Some(130..170)]);
    let later = scene.constraints_from(maneuver, 140, &[120, 140]);
    assert_eq!(later.len(), 2, "those of phases that are over are gone");

    let by_name = docking(&[
        (
            "actuators = [{ force = [1.0, 0.0, 0.0] }, { force = [0.0, 1.0, 0.0] }, { force = [0.0, 0.0, 1.0] }]\n",
            "",
        ),
        ("off = [0]", "off = [\"force\"]"),
        ("duration = { min = 20.0, max = 60.0 }\n", ""),
    ]);
    let scene = Scene::parse("test", &by_name).unwrap();
    let phases = &scene.maneuver.as_ref().unwrap().phases;
    assert_eq!(phases[2].off, [0, 1, 2]);
    assert_eq!([phases[2].min_steps, phases[2].max_steps], [10, 100]);
}

#[test]
fn phases_that_cannot_be_are_refused_by_key() {
    let hold = "duration = 20.0";
    for (edits, parts) in [
        (
            &[(hold, "duration = 20.5")][..],
            &[
                "`maneuver.phases[1].duration` is 20.5",
                "a whole number of steps of 1",
            ][..],
        ),
        (
            &[(hold, "duration = 0.0")],
            &["`maneuver.phases[1].duration` is 0.0"],
        ),
        (
            &[(hold, "")],
            &["`maneuver.phases[1].duration` is missing", "but the last"],
        ),
        (
            &[(hold, "duration = 170.0")],
            &[
                "`maneuver.phases` is 250 to 380 steps in all",
                "the 180 steps of the run",
            ],
        ),
        (
            &[("max = 60.0", "max = 15.0")],
            &[
                "`maneuver.phases[2].duration` is [20.0, 15.0]",
                "whole number",
            ],
        ),
        (
            &[("\"hold\"", "\"approach\"")],
            &[
                "`maneuver.phases[1].name` is \"approach\"",
                "no earlier phase",
            ],
        ),
        (
            &[("\"hold\"", "\" \"")],
            &["`maneuver.phases[1].name`", "a name"],
        ),
        (
            &[("off = [0]", "off = [3]")],
            &["`maneuver.phases[2].off` is 3", "from 0 to 2"],
        ),
        (
            &[("off = [0]", "off = [\"x\"]")],
            &["`maneuver.phases[2].off`", "the numbers of actuators"],
        ),
        (
            &[("radius = 1.0", "radius = -1.0")],
            &["`maneuver.phases[1].constraints[0].radius` is -1.0", "> 0"],
        ),
        (
            &[(
                "motion = \"translation\"",
                "motion = \"translation\"\nfinal_time = { min = 100.0 }",
            )],
            &["`maneuver.final_time`", "none beside `phases`"],
        ),
        (
            &[(
                "motion = \"translation\"",
                "motion = \"translation\"\nsearch = { starts = 3 }",
            )],
            &["`maneuver.search`", "lengths are to be found"],
        ),
        (
            &[
                (
                    "motion = \"translation\"",
                    "motion = \"translation\"\nfeedback = true",
                ),
                (
                    "kind = \"keep_out_sphere\"",
                    "kind = \"force_norm\"\nlimit = 3.0\n[[maneuver.phases.constraints]]\nkind = \"keep_out_sphere\"",
                ),
            ],
            &["`maneuver.feedback`", "limits in `maneuver.phases[0]`"],
        ),
        (
            &[
                (
                    "motion = \"translation\"",
                    "motion = \"translation\"\ncost = \"fuel\"",
                ),
                (
                    "kind = \"commands\"\nlimit = 25.0 ",
                    "kind = \"speed\"\nlimit = 25.0 ",
                ),
            ],
            &["`maneuver.cost`", "limits command 0"],
        ),
    ] {
        assert_refused(&docking(edits), parts);
    }
}

/// A coast, an approach, a hold and a last leg in a corridor, in local axes, in SI, drawn by lot.
fn drawn(rng: &mut fastrand::Rng) -> String {
    let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
    let radius = 6.378e6 + between(350e3, 1200e3);
    let [far, up, side] = [
        between(40.0, 120.0),
        between(-10.0, 10.0),
        between(-10.0, 10.0),
    ];
    let (hold, ball) = (between(10.0, 18.0), between(0.5, 2.0));
    let duration = between(300.0, 900.0).round();
    let [coast, approach, pause] =
        [0.1, 0.4, 0.15].map(|part| (0.2 * part * duration).round() * 5.0);
    format!(
        "title = \"Approach\"\n[run]\nduration = {duration}\nsteps = {duration}\nintegrator = \"lgvi\"\n\
         [gravity.central]\nbody = \"earth\"\n[[bodies]]\nname = \"station\"\nmass = 1900\ninertia = [1600, 2500, 2900]\n\
         orbit = {{ semi_major_axis = {radius}, eccentricity = 0.0, inclination = \"51 deg\", raan = \"20 deg\", true_anomaly = \"70 deg\" }}\n\
         attitude = {{ w = 1, x = 0, y = 0, z = 0 }}\nangular_velocity = [0, 0, 0]\n\
         [[bodies]]\nname = \"chaser\"\nmass = 800\ninertia = [600, 700, 750]\n\
         relative_to = {{ body = \"station\", axes = \"lvlh\" }}\nposition = [{far}, {up}, {side}]\nvelocity = [0, 0, 0]\n\
         attitude = {{ w = 0, x = 0, y = 0, z = 1 }}\nangular_velocity = [0, 0, 0]\n\
         [maneuver]\nbody = \"chaser\"\nmotion = \"translation\"\n\
         phases = [{{ name = \"coast\", duration = {coast}, off = [\"force\"] }}, {{ name = \"approach\", duration = {approach} }}, \
         {{ name = \"hold\", duration = {pause}, constraints = [{{ kind = \"keep_in_sphere\", center = [{hold}, 0, 0], radius = {ball}, \
         relative_to = {{ body = \"station\", axes = \"lvlh\" }} }}] }}, \
         {{ name = \"dock\", constraints = [{{ kind = \"corridor\", apex = [-0.5, 0, 0], axis = [1, 0, 0], half_angle = \"15 deg\", \
         relative_to = {{ body = \"station\", axes = \"lvlh\" }} }}] }}]\n\
         [maneuver.target]\nrelative_to = {{ body = \"station\", axes = \"lvlh\" }}\nposition = [3, 0, 0]\nvelocity = [0, 0, 0]\n"
    )
}

/// They are flown as planned: without force in the first leg, in the sphere while they hold, and to the target. The rest of a plan is planned
/// as it was.
#[test]
fn phases_in_a_low_orbit_are_planned_and_flown() {
    let mut rng = fastrand::Rng::with_seed(2027);
    let solved = |transfer: &Transfer| {
        let plan = solve(transfer, Start::Cold, &NewtonSettings::default(), |_| true);
        plan.unwrap_or_else(|error| panic!("{error}"))
    };
    for round in 0..8 {
        let text = drawn(&mut rng);
        let scene = Scene::parse("test", &text).unwrap_or_else(|error| panic!("{text}: {error}"));
        let maneuver = scene.maneuver.as_ref().unwrap();
        let plan = solved(&scene.transfer().unwrap().unwrap());
        assert!(
            plan.certificate.sufficient,
            "{round}: {:?}",
            plan.certificate
        );
        let switches = maneuver.proportional_switches(scene.steps);
        let sphere = &maneuver.phases[2].constraints[0];
        let mut simulation = scene.simulation(scene.scheme().unwrap()).unwrap();
        let mut states: Vec<BodyState> = vec![simulation.states()[1]];
        for control in &plan.controls {
            simulation.advance(&[Load::default(), *control]).unwrap();
            states.push(simulation.states()[1]);
        }
        for control in &plan.controls[..switches[0] as usize] {
            assert_eq!(control.force, Vector3::zeros());
        }
        let mut nearest = 0.0_f64;
        for step in switches[1]..=switches[2] {
            let region = sphere.region_at(scene.h() * step as f64);
            let Some(Region::InsideSphere { center, radius }) = region else {
                panic!("{region:?}");
            };
            let distance = (states[step as usize].position - center).norm();
            nearest = nearest.max(distance / radius);
        }
        assert!((0.99..1.0 + 1e-6).contains(&nearest), "{round}: {nearest}");
        let miss = scene.miss(states.last().unwrap()).unwrap();
        assert!(miss.norm() < 1e-2, "{round}: {miss}");

        let step = (switches[1] + 3) as usize;
        let rest = scene
            .transfer_of(
                scene.maneuver.as_ref().unwrap(),
                plan.states[step],
                plan.controls.len() - step,
                &switches,
            )
            .unwrap();
        let rest = solved(&rest);
        for (one, other) in plan.states[step..].iter().zip(&rest.states) {
            assert!((one.position - other.position).norm() < 1e-2, "{round}");
        }
    }
}
