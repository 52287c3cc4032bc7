//! What a recorded flight consists of: it begins anew with each reset, and goes on from other states where they were set.

use std::ops::Range;

use lgvi_msgs::msg::{ControlSequence, Intervention};

/// A flight from the scene's start to the next reset.
#[derive(Debug)]
pub struct Course<'b> {
    /// The control sequences, in the order of their acceptance.
    pub controls: &'b [ControlSequence],
    /// Its states, by their sequence numbers.
    pub samples: Range<u64>,
    /// Where states were set: the number of the first sample after, and what they were.
    pub set: Vec<(u64, &'b Intervention)>,
}

impl<'b> Course<'b> {
    /// The courses of a flight of which there are `samples`, number and step of each, in the order of their numbers, which
    /// were given from 0.
    ///
    /// The present state is published before and after each intervention: a sample whose step is not greater than that of
    /// the one before is the first after the next intervention. Samples may be missing where none of those is among them.
    pub fn of(
        samples: &[(u64, u64)],
        controls: &'b [ControlSequence],
        interventions: &'b [Intervention],
    ) -> Result<Vec<Self>, String> {
        let total = controls.len();
        let counts = interventions.iter().map(|intervention| {
            usize::try_from(intervention.controls)
                .ok()
                .filter(|count| *count <= total)
                .ok_or_else(|| {
                    let Intervention { controls, step, .. } = intervention;
                    format!(
                        "the intervention at step {step} follows {controls} control sequences, there are {total}"
                    )
                })
        });
        let counts = counts.collect::<Result<Vec<_>, _>>()?;
        let mut course = Course {
            controls: &[],
            samples: 0..0,
            set: Vec::new(),
        };
        let (mut courses, mut first) = (Vec::new(), 0);
        let mut next = interventions.iter().zip(&counts);
        let mut end = |course: &mut Course<'b>, sample: u64, count: usize| {
            course.samples.end = sample;
            course.controls = controls.get(first..count).ok_or_else(|| {
                format!("a reset follows {count} control sequences, the one before {first}")
            })?;
            first = count;
            Ok::<(), String>(())
        };
        // The first of all samples is of step 0, and has number 0.
        let before = std::iter::once((0, 0)).chain(samples.iter().copied());
        for ((number, before), (sample, step)) in before.zip(samples.iter().copied()) {
            let follows = sample.checked_sub(number) == step.checked_sub(before);
            if step > before && follows || (sample, step) == (0, 0) {
                continue;
            }
            if sample != number.saturating_add(1) {
                return Err(format!(
                    "sample {sample} of step {step} follows sample {number} of step {before}: between them an intervention may be missing"
                ));
            }
            if step > before {
                continue;
            }
            let (intervention, count) = next.next().ok_or_else(|| {
                format!(
                    "a state of step {step} follows one of step {before}, without an intervention"
                )
            })?;
            let reset = intervention.kind == Intervention::RESET;
            let at = intervention.step;
            if at != step || (step != before && !reset) {
                let kind = if reset { "a reset to" } else { "states set at" };
                return Err(format!(
                    "states of steps {before} and {step} follow each other, the next intervention is {kind} step {at}"
                ));
            }
            if reset {
                end(&mut course, sample, *count)?;
                let samples = sample..sample;
                let set = Vec::new();
                let controls = &[][..];
                courses.push(std::mem::replace(
                    &mut course,
                    Course {
                        controls,
                        samples,
                        set,
                    },
                ));
            } else {
                course.set.push((sample, intervention));
            }
        }
        // What came after the last recorded state.
        let rest = next.find(|(intervention, _)| intervention.kind == Intervention::RESET);
        let count = rest.map_or(total, |(_, count)| *count);
        let last = samples
            .last()
            .map_or(0, |(number, _)| number.saturating_add(1));
        end(&mut course, last, count)?;
        courses.push(course);
        Ok(courses)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(kind: u8, step: u64, controls: u64) -> Intervention {
        Intervention {
            kind,
            step,
            controls,
            ..Intervention::default()
        }
    }

    fn reset(controls: u64) -> Intervention {
        at(Intervention::RESET, 0, controls)
    }

    fn set(step: u64) -> Intervention {
        at(Intervention::SET_STATE, step, 1)
    }

    fn controls(count: u64) -> Vec<ControlSequence> {
        let sequence = |first_step| ControlSequence {
            first_step,
            ..ControlSequence::default()
        };
        (0..count).map(sequence).collect()
    }

    /// Samples, steps of the sequences and places where states were set, course by course.
    type Outline = (Range<u64>, Vec<u64>, Vec<u64>);

    fn outline(
        steps: &[u64],
        count: u64,
        interventions: &[Intervention],
    ) -> Result<Vec<Outline>, String> {
        let controls = controls(count);
        let samples: Vec<_> = (0..).zip(steps.iter().copied()).collect();
        let courses = Course::of(&samples, &controls, interventions)?;
        let outline = |course: Course<'_>| {
            let controls = course.controls.iter().map(|one| one.first_step).collect();
            let set = course.set.iter().map(|(sample, _)| *sample).collect();
            (course.samples, controls, set)
        };
        Ok(courses.into_iter().map(outline).collect())
    }

    #[test]
    fn without_interventions_there_is_one_course() {
        let expected = vec![(0..3, vec![0, 1], vec![])];
        assert_eq!(outline(&[0, 5, 10], 2, &[]), Ok(expected));
        assert_eq!(outline(&[], 0, &[]), Ok(vec![(0..0, vec![], vec![])]));
    }

    #[test]
    fn a_reset_begins_a_course_with_the_sequences_after_it() {
        let steps = [0, 0, 1, 2, 2, 3, 0, 1, 1];
        let interventions = [reset(1), set(2), reset(2), set(1)];
        let expected = vec![
            (0..1, vec![0], vec![]),
            (1..6, vec![1], vec![4]),
            (6..9, vec![2, 3], vec![8]),
        ];
        assert_eq!(outline(&steps, 4, &interventions), Ok(expected));
    }

    #[test]
    fn interventions_after_the_last_state_change_nothing_but_what_has_been_accepted_before() {
        let expected = vec![(0..2, vec![0], vec![])];
        let interventions = [set(1), reset(1)];
        assert_eq!(outline(&[0, 1], 3, &interventions), Ok(expected));
    }

    #[test]
    fn states_and_interventions_that_do_not_fit_are_refused() {
        let refused = |steps: &[u64], interventions: &[Intervention]| {
            outline(steps, 1, interventions).unwrap_err()
        };
        let text = refused(&[0, 1, 1], &[]);
        assert!(text.contains("without an intervention"), "{text}");
        let text = refused(&[0, 1, 1], &[set(2)]);
        assert!(text.contains("states set at step 2"), "{text}");
        let text = refused(&[0, 2, 1], &[set(1)]);
        assert!(text.contains("steps 2 and 1"), "{text}");
        let text = refused(&[0, 1, 1], &[reset(1)]);
        assert!(text.contains("a reset to step 0"), "{text}");
        let text = refused(&[0, 0], &[reset(2)]);
        assert!(
            text.contains("follows 2 control sequences, there are 1"),
            "{text}"
        );
        let text = refused(&[0, 0, 0], &[reset(1), reset(0)]);
        assert!(text.contains("the one before 1"), "{text}");
    }

    #[test]
    fn samples_may_be_missing_within_a_course_only() {
        let interventions = [reset(0)];
        let of = |samples: &[(u64, u64)]| {
            let courses = Course::of(samples, &[], &interventions);
            courses.map(|courses| {
                courses
                    .iter()
                    .map(|course| course.samples.clone())
                    .collect::<Vec<_>>()
            })
        };
        let whole = [(0, 0), (1, 1), (2, 2), (3, 3), (4, 0), (5, 1), (6, 2)];
        assert_eq!(of(&whole), Ok(vec![0..4, 4..7]));
        let gaps = [(1, 1), (3, 3), (4, 0), (6, 2)];
        assert_eq!(of(&gaps), Ok(vec![0..4, 4..7]));
        let hidden = [(0, 0), (2, 2), (5, 1), (6, 2)];
        assert!(of(&hidden).unwrap_err().contains("may be missing"));
        assert!(of(&[(4, 0)]).unwrap_err().contains("may be missing"));
    }
}
