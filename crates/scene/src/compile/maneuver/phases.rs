//! The phases of a maneuver: their lengths, their constraints, and the commands that are off in them.

use lgvi_control::{Actuation, Motion};

use super::constraints;
use super::prediction::Predictions;
use crate::file::{ManeuverFile, OffFile, PhaseDurationFile, PhaseFile};
use crate::{Phase, Scene, SceneError, check, suggestion};

/// Largest number of phases.
const MOST: usize = 16;

/// Tolerance within which a duration counts as whole steps (steps).
const ROUNDING: f64 = 1e-6;

/// Commands that are force and moment themselves, by name.
const LOADS: [(&str, [usize; 3]); 2] = [("force", [0, 1, 2]), ("moment", [3, 4, 5])];

pub(super) fn phases<'s>(
    scene: &'s Scene,
    body: usize,
    file: &'s ManeuverFile,
    motion: Motion,
    actuation: &Actuation,
    predictions: &mut Predictions<'s>,
) -> Result<Vec<Phase>, SceneError> {
    let files = &file.phases;
    if files.len() > MOST {
        let expected = format!("at most {MOST} phases");
        return Err(SceneError::value("maneuver.phases", files.len(), expected));
    }
    let mut phases = Vec::with_capacity(files.len());
    for (number, given) in files.iter().enumerate() {
        let key = |name: &str| format!("maneuver.phases[{number}].{name}");
        check_name(&key("name"), number, files)?;
        let is_last = number + 1 == files.len();
        let [min_steps, max_steps] = steps(scene, &key("duration"), given, is_last)?;
        let off = off(scene, body, file, &key("off"), given, actuation)?;
        let place = key("constraints");
        let rigid = &scene.bodies[body].body;
        let given = (&given.constraints[..], &place[..]);
        let constraints =
            constraints::constraints(scene, rigid, given, motion, actuation, predictions)?;
        phases.push(Phase {
            name: files[number].name.clone(),
            min_steps,
            max_steps,
            constraints,
            off,
        });
    }
    check_sum(scene, &mut phases)?;
    let commands = actuation.commands();
    if !phases.is_empty() && phases.iter().all(|phase| phase.off.len() == commands) {
        let expected = "a phase in which some commands are on";
        return Err(SceneError::value("maneuver.phases", "all off", expected));
    }
    Ok(phases)
}

fn check_name(key: &str, number: usize, files: &[PhaseFile]) -> Result<(), SceneError> {
    let name = &files[number].name;
    if name.trim().is_empty() {
        return Err(SceneError::value(key, name, "a name"));
    }
    let mut earlier = files[..number].iter();
    if earlier.any(|other| other.name == *name) {
        let expected = "a name that no earlier phase has";
        return Err(SceneError::value(key, name, expected));
    }
    Ok(())
}

/// The least and the largest number of steps that a phase lasts.
fn steps(
    scene: &Scene,
    key: &str,
    file: &PhaseFile,
    is_last: bool,
) -> Result<[u64; 2], SceneError> {
    let h = scene.h();
    match file.duration {
        None if is_last => Ok([1, scene.steps]),
        None => {
            let expected = "one of each phase but the last, which may last for the rest of the run";
            Err(SceneError::missing(key, expected))
        }
        Some(PhaseDurationFile::Fixed(duration)) => {
            let steps = check::positive(key, duration)? / h;
            if (steps - steps.round()).abs() > ROUNDING || steps.round() < 1.0 {
                let expected = format!("a whole number of steps of {h}");
                return Err(SceneError::value(key, duration, expected));
            }
            Ok([steps.round() as u64; 2])
        }
        Some(PhaseDurationFile::Range(range)) => {
            let [min, max] = [("min", range.min), ("max", range.max)]
                .map(|(name, value)| check::positive(&format!("{key}.{name}"), value));
            let (min, max) = (min?, max?);
            let least = ((min / h - ROUNDING).ceil() as u64).max(1);
            let most = ((max / h + ROUNDING).floor() as u64).min(scene.steps);
            if least > most {
                let expected = format!(
                    "a range that holds a whole number of steps of {h}, at most the {} of the run",
                    scene.steps
                );
                return Err(SceneError::value(key, [min, max], expected));
            }
            Ok([least, most])
        }
    }
}

/// The indices of the commands that are off.
fn off(
    scene: &Scene,
    body: usize,
    file: &ManeuverFile,
    key: &str,
    phase: &PhaseFile,
    actuation: &Actuation,
) -> Result<Vec<usize>, SceneError> {
    let named = &scene.bodies[body];
    let names = if actuation.is_of_wheels() {
        &named.wheels
    } else {
        &named.thrusters
    };
    let mut all = Vec::new();
    for given in &phase.off {
        match given {
            OffFile::Number(number) if file.actuators.is_some() => {
                if *number >= actuation.commands() {
                    let expected = format!(
                        "the numbers of actuators, from 0 to {}",
                        actuation.commands() - 1
                    );
                    return Err(SceneError::value(key, number, expected));
                }
                all.push(*number);
            }
            OffFile::Name(name) if actuation.is_of_loads() => {
                let known = LOADS.iter().find(|(known, _)| known == name);
                let Some((_, commands)) = known else {
                    return Err(SceneError::unknown(key, name, &LOADS.map(|(name, _)| name)));
                };
                all.extend(commands);
            }
            OffFile::Name(name) if file.actuators.is_none() => {
                let known = names.iter().position(|known| known == name);
                let Some(command) = known else {
                    let known: Vec<_> = names.iter().map(String::as_str).collect();
                    return Err(SceneError::value(
                        key,
                        name,
                        suggestion::one_of(name, &known),
                    ));
                };
                all.push(command);
            }
            given => {
                let expected = if file.actuators.is_some() {
                    "the numbers of actuators, from 0"
                } else {
                    "names"
                };
                return Err(SceneError::value(key, given, expected));
            }
        }
    }
    all.sort_unstable();
    all.dedup();
    Ok(all)
}

/// Checks that the phases can last for the run together, and narrows their ranges to what the others leave.
fn check_sum(scene: &Scene, phases: &mut [Phase]) -> Result<(), SceneError> {
    if phases.is_empty() {
        return Ok(());
    }
    let [least, most] = [
        |phase: &Phase| phase.min_steps,
        |phase: &Phase| phase.max_steps,
    ]
    .map(|steps| phases.iter().map(steps).sum::<u64>());
    if !(least..=most).contains(&scene.steps) {
        let value = if least == most {
            format!("{least} steps in all")
        } else {
            format!("{least} to {most} steps in all")
        };
        return Err(SceneError::Value {
            line: None,
            key: "maneuver.phases".into(),
            value,
            expected: format!("phases that last for the {} steps of the run", scene.steps),
        });
    }
    for phase in phases {
        let (own_least, own_most) = (phase.min_steps, phase.max_steps);
        // What is left where all others are as short, or as long, as they may be.
        phase.max_steps = own_most.min(scene.steps - (least - own_least));
        phase.min_steps = own_least.max(scene.steps.saturating_sub(most - own_most));
    }
    Ok(())
}
