//! The free asymmetric body in closed form: at any time at one price.

use lgvi_dynamics::Method;
use lgvi_truth::Case;

use crate::error::BenchError;
use crate::flight::fly;
use crate::peer::Peer;

const CASES: [&str; 2] = ["b1_free_asymmetric", "b2_dzhanibekov"];

/// The last time that the reference knows.
const T: f64 = 1000.0;

/// A time that no stepping reaches; the peer's is its time to `T`, scaled.
const FAR: f64 = 1e9;

pub(crate) fn run(peer: Option<&Peer>, repeats: u32) -> Result<(), BenchError> {
    for name in CASES {
        let case = Case::load(name)?;
        let own = fly(&case, T, Method::ClosedForm, 1, repeats.max(20))?;
        println!(
            "{name}: closed form to t = {T} in {:.0} ns, attitude error {:.1e}",
            1e9 * own.seconds,
            own.errors.attitude
        );
        let (system, states) = case.system()?;
        let far = crate::flight::time_to(system, states, Method::ClosedForm, FAR, repeats.max(20))?;
        println!("{name}: closed form to t = {FAR:e} in {:.0} ns", 1e9 * far);
        let Some(peer) = peer else { continue };
        for flown in peer.fly(name, T, &[1e-8, 1e-12, 1e-15], repeats)? {
            println!(
                "{name}: heyoka, tolerance {:.0e}, to t = {T} in {:.0} ns, attitude error {:.1e}: {:.0} times as long, \
                 and to t = {FAR:e}, a {:.0e}th part of which this is, {:.1e} times",
                flown.tolerance,
                1e9 * flown.seconds,
                flown.attitude,
                flown.seconds / own.seconds,
                FAR / T,
                flown.seconds / far * FAR / T,
            );
        }
    }
    Ok(())
}
