//! Initial states: given in the inertial frame, by orbital elements, or relative to another body.

use lgvi_dynamics::{BodyState, Mobility, RigidBody};
use nalgebra::Vector3;

use super::elements::elements;
use crate::axes::{Axes, AxesFile, Motion};
use crate::file::{BodyFile, ElementsFile, RelativeFile};
use crate::{SceneError, SceneGravity, check};

/// The bodies of a scene whose states are being found.
pub(super) struct Bodies<'a> {
    pub files: &'a [BodyFile],
    pub bodies: &'a [RigidBody],
    pub gravity: &'a SceneGravity,
}

/// The states that are known.
type Known = [Option<BodyState>];

/// What the mobility of a body leaves free.
struct Freedom {
    moves: bool,
    turns: bool,
    kind: &'static str,
}

impl Bodies<'_> {
    /// Returns the states at the epoch. The states that a state refers to are found before it.
    pub(super) fn states(&self) -> Result<Vec<BodyState>, SceneError> {
        let count = self.files.len();
        let needs = (0..count).map(|index| self.needs(index));
        let needs = needs.collect::<Result<Vec<_>, _>>()?;
        let mut states = vec![None; count];
        loop {
            let known = |states: &Known, index: usize| {
                let mut needed = needs[index].iter();
                needed.all(|(_, needed)| states[*needed].is_some())
            };
            let mut open = (0..count).filter(|index| states[*index].is_none());
            match open.find(|index| known(&states, *index)) {
                Some(index) => states[index] = Some(self.state(index, &states)?),
                None => break,
            }
        }
        // What is still unknown waits for what is unknown.
        let waits = |(index, state): (usize, &Option<BodyState>)| {
            let mut needed = needs[index].iter();
            needed.find(|(_, needed)| state.is_none() && states[*needed].is_none())
        };
        match states.iter().enumerate().find_map(waits) {
            None => Ok(states.into_iter().flatten().collect()),
            Some((key, other)) => {
                let expected = "a body whose state does not depend on this body (these references form a cycle)";
                Err(SceneError::value(key, &self.files[*other].name, expected))
            }
        }
    }

    /// Returns the bodies that the state of a body depends on, with the keys that name them.
    fn needs(&self, index: usize) -> Result<Vec<(String, usize)>, SceneError> {
        let file = &self.files[index];
        let (orbit, relative) = (file.orbit.as_ref(), file.relative_to.as_ref());
        let named = [
            ("orbit.about", orbit.and_then(|orbit| orbit.about.as_ref())),
            ("relative_to.body", relative.map(|relative| &relative.body)),
            (
                "relative_to.about",
                relative.and_then(|relative| relative.about.as_ref()),
            ),
        ];
        let mut needs = Vec::new();
        for (name, body) in named {
            let Some(body) = body else { continue };
            let key = format!("bodies[{index}].{name}");
            let other = self.index(&key, body)?;
            // Axes of its own orbit are those of the rest of its state.
            if !(other == index && name == "relative_to.body") {
                needs.push((key, other));
            }
        }
        Ok(needs)
    }

    fn index(&self, key: &str, name: &str) -> Result<usize, SceneError> {
        let found = self.files.iter().position(|file| file.name == name);
        found.ok_or_else(|| {
            let names: Vec<_> = self.files.iter().map(|file| file.name.as_str()).collect();
            SceneError::unknown(key, name, &names)
        })
    }

    /// Whether the elements of a body's orbit are about another body.
    fn orbits_a_body(&self, name: &str) -> bool {
        let mut files = self.files.iter();
        let file = files.find(|file| file.name == name);
        file.and_then(|file| file.orbit.as_ref())
            .is_some_and(|orbit| orbit.about.is_some())
    }

    /// Returns the motion of a body whose state is known.
    fn motion(&self, key: &str, name: &str, known: &Known) -> Result<Motion, SceneError> {
        let index = self.index(key, name)?;
        let state = known[index].as_ref();
        let state = state.ok_or_else(|| SceneError::value(key, name, "another body"))?;
        Ok(Motion::of(&self.bodies[index], state))
    }

    /// Returns the state of a body; those that it depends on are known.
    fn state(&self, index: usize, known: &Known) -> Result<BodyState, SceneError> {
        let (file, body) = (&self.files[index], &self.bodies[index]);
        let key = |name: &str| format!("bodies[{index}].{name}");
        let freedom = Freedom::of(body);
        let [position, velocity] = match &file.orbit {
            Some(orbit) => self.on_orbit(index, orbit, &freedom, known)?,
            None => {
                let position = file.position.ok_or_else(|| {
                    SceneError::missing(key("position"), "three numbers, or an `orbit`")
                })?;
                [
                    check::vector(&key("position"), position)?,
                    freedom.rate(key("velocity"), file.velocity, freedom.moves)?,
                ]
            }
        };
        let (name, rate) = (key("angular_velocity"), file.angular_velocity);
        let given = Motion {
            position,
            velocity,
            attitude: check::rotation(&key("attitude"), &file.attitude)?,
            angular_velocity: freedom.rate(name, rate, freedom.turns)?,
        };
        let Motion {
            position,
            velocity,
            attitude,
            angular_velocity,
        } = match &file.relative_to {
            None => given,
            Some(relative) => self.relative(index, relative, given, known)?,
        };
        Ok(match body.mobility() {
            Mobility::Driven(drive) => drive.state(body, position, attitude),
            Mobility::Free | Mobility::Pivoted | Mobility::Fixed => {
                let velocity = if freedom.moves {
                    velocity
                } else {
                    Vector3::zeros()
                };
                let rate = if freedom.turns {
                    angular_velocity
                } else {
                    Vector3::zeros()
                };
                BodyState::from_velocities(body, position, velocity, attitude, rate)
            }
        })
    }

    /// Returns position and velocity on an orbit about the attractor or another body.
    fn on_orbit(
        &self,
        index: usize,
        file: &ElementsFile,
        freedom: &Freedom,
        known: &Known,
    ) -> Result<[Vector3<f64>; 2], SceneError> {
        let BodyFile {
            position, velocity, ..
        } = &self.files[index];
        for (name, value) in [("position", position), ("velocity", velocity)] {
            if let Some(value) = value {
                let key = format!("bodies[{index}].{name}");
                return Err(SceneError::value(
                    key,
                    value,
                    "none, because `orbit` gives it: give `orbit` or `position` and `velocity`",
                ));
            }
        }
        let key = format!("bodies[{index}].orbit");
        if !freedom.moves {
            let expected = format!("none: the body is {}", freedom.kind);
            return Err(SceneError::value(key, "given", expected));
        }
        let about = format!("{key}.about");
        let (gm, center) = match (&file.about, &self.gravity.central) {
            (Some(name), _) => {
                let Some(constant) = self.gravity.mutual else {
                    let expected = "none without `gravity.mutual`: the body does not attract";
                    return Err(SceneError::value(about, name, expected));
                };
                let center = &self.bodies[self.index(&about, name)?];
                // Of the acceleration of the one relative to the other: two free bodies fall towards each other.
                let mass = match center.mobility() {
                    Mobility::Free => center.mass() + self.bodies[index].mass(),
                    _ => center.mass(),
                };
                (constant * mass, self.motion(&about, name, known)?)
            }
            (None, Some(central)) => (central.gm, Motion::at(central.position)),
            (None, None) => {
                let expected =
                    "the name of the body in the center, as there is no `gravity.central`";
                return Err(SceneError::missing(about, expected));
            }
        };
        let [position, velocity] = elements(&key, file)?.state(gm);
        Ok([center.position + position, center.velocity + velocity])
    }

    /// Returns the inertial motion of a body that is `given` relative to axes. On an orbit, or relative to axes of its own
    /// orbit, only attitude and angular velocity are.
    fn relative(
        &self,
        index: usize,
        file: &RelativeFile,
        given: Motion,
        known: &Known,
    ) -> Result<Motion, SceneError> {
        let key = |name: &str| format!("bodies[{index}].relative_to.{name}");
        let own = file.body == self.files[index].name;
        let orbital = matches!(file.axes, AxesFile::Rtn | AxesFile::Lvlh);
        if own && !orbital {
            let expected = "rtn or lvlh beside the body's own name";
            return Err(SceneError::value(
                key("axes"),
                file.axes.to_string(),
                expected,
            ));
        }
        let reference = match own {
            true => given,
            false => self.motion(&key("body"), &file.body, known)?,
        };
        let center = match (&file.about, &self.gravity.central) {
            (Some(name), _) if !orbital => {
                let expected = format!("none beside {} axes, which have no center", file.axes);
                return Err(SceneError::value(key("about"), name, expected));
            }
            (Some(name), _) => self.motion(&key("about"), name, known)?,
            (None, _) if orbital && self.orbits_a_body(&file.body) => {
                let expected = "the name of the body in the center, which `orbit.about` names";
                return Err(SceneError::missing(key("about"), expected));
            }
            (None, Some(central)) => Motion::at(central.position),
            (None, None) if orbital => {
                let expected =
                    "the name of the body in the center, as there is no `gravity.central`";
                return Err(SceneError::missing(key("about"), expected));
            }
            (None, None) => Motion::at(Vector3::zeros()),
        };
        let axes = Axes::of(file.axes, &reference, &center).ok_or_else(|| {
            let expected = format!(
                "a body that moves around its center, for {} axes",
                file.axes
            );
            SceneError::value(key("body"), &file.body, expected)
        })?;
        let moved = axes.moved(&given);
        if own || self.files[index].orbit.is_some() {
            let Motion {
                position, velocity, ..
            } = given;
            return Ok(Motion {
                position,
                velocity,
                ..moved
            });
        }
        Ok(moved)
    }
}

/// Returns how the state of a body is given, unless by numbers in the inertial frame.
pub(super) fn given(file: &BodyFile) -> Option<String> {
    let about = |about: &Option<String>| match about {
        Some(body) => format!(" about {body}"),
        None => String::new(),
    };
    let orbit = file.orbit.as_ref();
    let orbit = orbit.map(|orbit| format!("orbital elements{}", about(&orbit.about)));
    let relative = file.relative_to.as_ref().map(|relative| {
        let RelativeFile { body, axes, .. } = relative;
        format!("{axes} axes of {body}{}", about(&relative.about))
    });
    let parts: Vec<_> = orbit.into_iter().chain(relative).collect();
    (!parts.is_empty()).then(|| parts.join(", "))
}

impl Freedom {
    fn of(body: &RigidBody) -> Self {
        let (moves, turns, kind) = match body.mobility() {
            Mobility::Free => (true, true, "free"),
            Mobility::Pivoted => (false, true, "pivoted"),
            Mobility::Fixed => (false, false, "fixed"),
            Mobility::Driven(_) => (false, false, "driven"),
        };
        Self { moves, turns, kind }
    }

    /// Returns a velocity, which must be given if it is free and must not if it is not.
    fn rate(
        &self,
        key: String,
        value: Option<[f64; 3]>,
        wanted: bool,
    ) -> Result<Vector3<f64>, SceneError> {
        match value {
            Some(value) if wanted => check::vector(&key, value),
            Some(value) => {
                let expected = format!("none: the body is {}", self.kind);
                Err(SceneError::value(key, value, expected))
            }
            None if wanted => {
                let expected = format!("three numbers, as the body is {}", self.kind);
                Err(SceneError::missing(key, expected))
            }
            None => Ok(Vector3::zeros()),
        }
    }
}
