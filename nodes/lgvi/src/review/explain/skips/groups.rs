//! What many bodies, or many interactions, have in common.

use super::{Body, Interaction};

/// Things of which the same is to be said.
pub(super) type Group<'a, T> = Vec<&'a T>;

/// Those of `things` of which `said` is the same, in the order of the first of each.
fn groups<'a, T, S: PartialEq>(things: &'a [T], said: impl Fn(&T) -> S) -> Vec<Group<'a, T>> {
    let mut groups: Vec<(S, Group<'a, T>)> = Vec::new();
    for thing in things {
        let key = said(thing);
        match groups.iter_mut().find(|(other, _)| *other == key) {
            Some((_, group)) => group.push(thing),
            None => groups.push((key, vec![thing])),
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

pub(super) fn bodies(bodies: &[Body]) -> Vec<Group<'_, Body>> {
    groups(bodies, |body| {
        (body.translation, body.rotation, body.moment)
    })
}

pub(super) fn interactions(interactions: &[Interaction]) -> Vec<Group<'_, Interaction>> {
    groups(interactions, |one| {
        let with = one.between[1].starts_with("the ");
        (one.computed, one.why, with)
    })
}
